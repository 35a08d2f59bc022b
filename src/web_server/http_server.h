// Answers HTTP/1.1 requests. One thread reads requests and writes answers, which other threads may make. Requests are
// bounded in number, size and time. One request per connection.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "web_server/request_check.h"

namespace bslam::web_server {

struct ServerOptions {
  std::string address = "127.0.0.1";  // address of the interface
  std::uint16_t port = 0;             // 0: any free one
  bool or_any_port = false;           // if the port is in use, any free one is taken
};

// Returns true for an IP address that only programs on this machine can reach, such as 127.0.0.1.
bool is_loopback(const std::string& address);

struct HttpLimits {
  std::size_t connections = 16;  // further ones are closed at once
  std::uint64_t body_bytes = 0;  // maximum of one request; a longer one is answered with 413
  // Maximum of all unanswered requests together; a further one is answered with 503.
  std::uint64_t all_bodies_bytes = 0;
  // Time in which a whole request must arrive; otherwise its connection is closed.
  std::chrono::seconds request_time{10};
};

struct Response {
  int status = 200;
  std::string body = {};
  std::string type = "text/plain; charset=utf-8";
  std::vector<std::pair<std::string, std::string>> headers = {};
};

// Passes the answer of a request on; to be called at most once, by any thread. A copy must not outlive the server.
using Respond = std::function<void(Response)>;

// Decides on requests. All functions are called by the thread of the server, and must return soon.
class RequestHandler {
 public:
  virtual ~RequestHandler() = default;

  // The answer to a request that is refused before its body is read; nullopt: it is accepted.
  virtual std::optional<Response> refuse(const RequestHead& head) = 0;
  // The answer to a request that the server itself refuses, with a sentence that says why. By default it is plain text.
  virtual Response refusal(int status, std::string_view sentence);
  // An accepted request with its whole body.
  virtual void handle(const RequestHead& head, std::string body, Respond respond) = 0;
  // Called for every request when its answer is known. This includes requests with an HTTP error (then the head may be
  // empty) and requests that took too long, which count as 408 and get no answer.
  virtual void answered(const RequestHead& head, int status);
};

class HttpServer {
 public:
  // Begins to listen, and to answer. `handler` must outlive the server. Errors, with the keys "address" and "port": the
  // address is not that of an interface, the port is in use or not permitted.
  static Result<std::unique_ptr<HttpServer>> start(const ServerOptions& options, const HttpLimits& limits,
                                                   RequestHandler& handler);
  // Closes all connections.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  const std::string& url() const;  // such as http://127.0.0.1:8090

  // Accepts no further connections, and waits for at most `limit` until the answers of all accepted requests are sent.
  void finish(std::chrono::milliseconds limit);

 private:
  class Implementation;
  explicit HttpServer(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace bslam::web_server
