#include "web_server/http_server.h"

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/post.hpp>
#include <future>
#include <thread>

#include "web_server/http_connection.h"

namespace bslam::web_server {

Response RequestHandler::refusal(int status, std::string_view sentence) {
  return {status, std::string(sentence) + "\n"};
}
void RequestHandler::answered(const RequestHead&, int) {}

bool is_loopback(const std::string& address) {
  boost::system::error_code error;
  const auto parsed = boost::asio::ip::make_address(address, error);
  return !error && parsed.is_loopback();
}

class HttpServer::Implementation {
 public:
  Implementation(const HttpLimits& limits, RequestHandler& handler)
      : connections_(limits, handler), answers_(boost::asio::make_work_guard(connections_.context())) {}
  ~Implementation() {
    connections_.context().stop();
    if (thread_.joinable()) thread_.join();
  }

  Status start(const ServerOptions& options) {
    if (const Status s = connections_.listen(options); !s) return s;
    thread_ = std::thread([this] { run(); });
    return {};
  }

  const std::string& url() const { return connections_.url(); }

  void finish(std::chrono::milliseconds limit) {
    const auto finished = std::make_shared<std::promise<void>>();
    std::future<void> future = finished->get_future();
    boost::asio::post(connections_.context(), [this, finished] {
      connections_.close();
      connections_.when_idle([finished] { finished->set_value(); });
    });
    future.wait_for(limit);
  }

 private:
  void run() {
    for (;;) {
      try {
        connections_.context().run();
        return;
      } catch (const std::exception&) {  // such as a lack of memory: of one connection, which was closed
      }
    }
  }

  Connections connections_;
  // Answers may come when nothing else is left to do for the server.
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> answers_;
  std::thread thread_;
};

HttpServer::HttpServer(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}
HttpServer::~HttpServer() = default;

Result<std::unique_ptr<HttpServer>> HttpServer::start(const ServerOptions& options, const HttpLimits& limits,
                                                      RequestHandler& handler) {
  auto implementation = std::make_unique<Implementation>(limits, handler);
  if (const Status s = implementation->start(options); !s) return s.error();
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(implementation)));
}

const std::string& HttpServer::url() const { return implementation_->url(); }
void HttpServer::finish(std::chrono::milliseconds limit) { implementation_->finish(limit); }

}  // namespace bslam::web_server
