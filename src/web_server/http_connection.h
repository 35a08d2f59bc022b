// The connections of a server, with Boost.Beast. Internal to this folder. All of it runs in one thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <functional>
#include <memory>
#include <string>

#include "web_server/http_server.h"

namespace bslam::web_server {

using Request = boost::beast::http::request<boost::beast::http::string_body>;
using Socket = boost::asio::ip::tcp::socket;
// As long as a copy exists, a connection counts as open.
using Slot = std::shared_ptr<const void>;

class Connections {
 public:
  // Takes over the connection of a request for a WebSocket that was not refused.
  using Upgrade = std::function<void(Request, Socket, Slot)>;

  // `handler` must outlive the connections. Without `upgrade` WebSockets are not supported.
  Connections(const HttpLimits& limits, RequestHandler& handler, Upgrade upgrade = {});

  // The event loop of the server's thread. Its destruction closes all remaining connections.
  boost::asio::io_context& context() { return context_; }

  // Begins to accept connections. Errors: see HttpServer::start.
  Status listen(const ServerOptions& options);
  // Accepts no further connections.
  void close();
  // Calls `idle` once no request is being answered, maybe at once.
  void when_idle(std::function<void()> idle);

  const std::string& url() const { return url_; }
  bool loopback() const { return loopback_; }  // the address is that of this machine only

 private:
  friend class Connection;
  boost::system::error_code open(const boost::asio::ip::tcp::endpoint& endpoint);
  void accept();
  void begin(Socket socket);
  void accept_later();
  void answer_begins() { ++answering_; }
  void answer_ends();

  const HttpLimits limits_;
  RequestHandler& handler_;
  const Upgrade upgrade_;
  std::string url_;
  bool loopback_ = true;
  std::size_t open_ = 0;          // connections
  std::size_t answering_ = 0;     // accepted requests whose answer is not sent
  std::uint64_t body_bytes_ = 0;  // total declared size of the bodies of all requests that are not answered yet
  std::function<void()> idle_;
  // Declared after the members that connections use, because its destructor destroys the connections.
  boost::asio::io_context context_{1};
  boost::asio::ip::tcp::acceptor acceptor_{context_};
  boost::asio::steady_timer retry_{context_};
};

}  // namespace bslam::web_server
