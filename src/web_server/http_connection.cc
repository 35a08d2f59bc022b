#include "web_server/http_connection.h"

#include <array>
#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <chrono>

namespace bslam::web_server {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using ErrorCode = boost::system::error_code;

namespace {

constexpr std::uint32_t kMaxHeader = 16 * 1024;
constexpr auto kResponseTime = std::chrono::seconds(30);
constexpr auto kDrainTime = std::chrono::seconds(5);
constexpr std::chrono::milliseconds kRetryAfter{100};  // after a connection could not be accepted
constexpr int kSendBuffer = 256 * 1024;                // bytes; a larger buffer would only delay the newest update

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

RequestHead head_of(const Request& request) {
  return {.target = view(request.target()),
          .host = view(request[http::field::host]),
          .origin = view(request[http::field::origin]),
          .method = view(request.method_string()),
          .authorization = view(request[http::field::authorization]),
          .content_type = view(request[http::field::content_type]),
          .websocket = beast::websocket::is_upgrade(request)};
}

// The answer to an invalid request.
Response response_to(ErrorCode error, std::uint64_t max_body, RequestHandler& handler) {
  if (error == http::error::body_limit)
    return handler.refusal(413,
                           "The request is too long: at most " + std::to_string(max_body) + " bytes are accepted.");
  if (error == http::error::header_limit || error == http::error::buffer_overflow)
    return handler.refusal(431, "The header of the request is too long.");
  return handler.refusal(400, "This is not a request that this server understands.");
}

}  // namespace

// A connection whose request is being received or answered.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Connections& all, Socket socket, Slot slot)
      : all_(all), slot_(std::move(slot)), stream_(std::move(socket)) {
    parser_.header_limit(kMaxHeader);
    parser_.body_limit(all.limits_.body_bytes);
  }
  ~Connection() { end_answer(); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void read() {
    stream_.expires_after(all_.limits_.request_time);
    http::async_read_header(stream_, buffer_, parser_, [self = shared_from_this()](ErrorCode error, std::size_t) {
      if (error) return self->fail(error);
      self->begin();
    });
  }

 private:
  // Decides by the header of the request.
  void begin() {
    all_.answer_begins();
    answering_ = true;
    const RequestHead head = head_of(parser_.get());
    if (auto refused = all_.handler_.refuse(head)) return respond(*std::move(refused));
    if (head.websocket && all_.upgrade_) {
      stream_.expires_never();
      return all_.upgrade_(parser_.release(), stream_.release_socket(), std::move(slot_));
    }
    if (parser_.chunked()) return refuse(411, "The request must state the length of its body.");
    const std::uint64_t length = parser_.content_length().value_or(0);
    if (length > 0 && head.method != "POST") return refuse(400, "Only a POST request may have a body.");
    if (length > all_.limits_.all_bodies_bytes - all_.body_bytes_)
      return refuse(503, "Too many requests at once.", {{"Retry-After", "1"}});
    reserved_ = length;
    all_.body_bytes_ += length;
    if (beast::iequals(parser_.get()[http::field::expect], "100-continue")) return invite_body();
    read_body();
  }

  // Some clients send a long body only after this.
  void invite_body() {
    static constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";
    asio::async_write(stream_, asio::buffer(kContinue), [self = shared_from_this()](ErrorCode error, std::size_t) {
      if (!error) self->read_body();
    });
  }

  void read_body() {
    http::async_read(stream_, buffer_, parser_, [self = shared_from_this()](ErrorCode error, std::size_t) {
      if (error) return self->fail(error);
      self->pass_on();
    });
  }

  void pass_on() {
    stream_.expires_never();
    std::string body = std::move(parser_.get().body());
    // The thread that answers keeps no reference: connections end in the thread of the server.
    all_.handler_.handle(head_of(parser_.get()), std::move(body),
                         [self = shared_from_this(), executor = stream_.get_executor()](Response response) mutable {
                           asio::post(executor, [self = std::move(self), response = std::move(response)]() mutable {
                             self->respond(std::move(response));
                           });
                         });
  }

  void fail(ErrorCode error) {
    const RequestHead head = head_of(parser_.get());
    if (error == beast::error::timeout) return all_.handler_.answered(head, 408);
    const bool of_http = error.category() == http::make_error_code(http::error::bad_method).category();
    if (of_http && error != http::error::end_of_stream && error != http::error::partial_message)
      respond(response_to(error, all_.limits_.body_bytes, all_.handler_));
  }

  void refuse(int status, std::string_view sentence, std::vector<std::pair<std::string, std::string>> headers = {}) {
    Response response = all_.handler_.refusal(status, sentence);
    response.headers = std::move(headers);
    respond(std::move(response));
  }

  void respond(Response response) {
    all_.handler_.answered(head_of(parser_.get()), response.status);
    response_.result(static_cast<unsigned>(response.status));
    response_.set(http::field::content_type, response.type);
    response_.set(http::field::cache_control, "no-store");
    response_.set("Referrer-Policy", "no-referrer");
    response_.set("X-Content-Type-Options", "nosniff");
    for (const auto& [name, value] : response.headers) response_.set(name, value);
    response_.keep_alive(false);
    response_.body() = std::move(response.body);
    response_.prepare_payload();
    stream_.expires_after(kResponseTime);
    http::async_write(stream_, response_, [self = shared_from_this()](ErrorCode error, std::size_t) {
      self->end_answer();
      if (!error) self->drain();
    });
  }

  // Lets the client read the answer: a connection that is closed while the client still sends would be reset.
  void drain() {
    ErrorCode ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    stream_.expires_after(kDrainTime);
    discard();
  }

  void discard() {
    stream_.async_read_some(asio::buffer(discarded_), [self = shared_from_this()](ErrorCode error, std::size_t) {
      if (!error) self->discard();
    });
  }

  void end_answer() {
    all_.body_bytes_ -= std::exchange(reserved_, 0);
    if (std::exchange(answering_, false)) all_.answer_ends();
  }

  Connections& all_;
  Slot slot_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{kMaxHeader + 1024};
  http::request_parser<http::string_body> parser_;
  http::response<http::string_body> response_;
  std::array<char, 4096> discarded_{};
  std::uint64_t reserved_ = 0;  // bytes of the body
  bool answering_ = false;
};

Connections::Connections(const HttpLimits& limits, RequestHandler& handler, Upgrade upgrade)
    : limits_(limits), handler_(handler), upgrade_(std::move(upgrade)) {}

Status Connections::listen(const ServerOptions& options) {
  ErrorCode error;
  const asio::ip::address address = asio::ip::make_address(options.address, error);
  if (error) return Error{"web server", "address", options.address, "an IP address of this machine, such as 0.0.0.0"};
  loopback_ = is_loopback(options.address);
  error = open({address, options.port});
  if (error == asio::error::address_in_use && options.or_any_port) error = open({address, 0});
  const std::string port = "port " + std::to_string(options.port);
  if (error == asio::error::address_in_use)
    return Error{"web server", "port", port + ", which is in use", "a free port, or 0 for any free one"};
  if (error == asio::error::access_denied)
    return Error{"web server", "port", port + ", which is not permitted", "a port above 1023, or 0 for any free one"};
  if (error)
    return Error{"web server", "address", options.address + ": " + error.message(), "an address of this machine"};
  const std::string host = address.is_unspecified() ? "127.0.0.1" : options.address;
  url_ = "http://" + (address.is_v6() && !address.is_unspecified() ? "[" + host + "]" : host) + ":" +
         std::to_string(acceptor_.local_endpoint().port());
  accept();
  return {};
}

ErrorCode Connections::open(const tcp::endpoint& endpoint) {
  ErrorCode error;
  if (acceptor_.is_open()) acceptor_.close();
  acceptor_.open(endpoint.protocol(), error);
  if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor_.bind(endpoint, error);
  if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
  return error;
}

void Connections::accept() {
  acceptor_.async_accept([this](ErrorCode error, tcp::socket socket) {
    if (error == asio::error::operation_aborted || !acceptor_.is_open()) return;
    // A lack of file descriptors lasts; trying again at once would keep the thread busy.
    if (error) return accept_later();
    accept();  // before anything that needs memory: this operation takes over that of the one that has ended
    begin(std::move(socket));
  });
}

// Reads the request of a new connection, or closes it if there are too many or memory is lacking.
void Connections::begin(tcp::socket socket) {
  if (open_ >= limits_.connections) return;
  try {
    ErrorCode ignored;
    socket.set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
    socket.set_option(tcp::no_delay(true), ignored);
    ++open_;
    Slot slot(this, [](Connections* all) { --all->open_; });  // calls this also if it throws
    std::make_shared<Connection>(*this, std::move(socket), std::move(slot))->read();
  } catch (const std::exception&) {  // the destructors have closed the connection
  }
}

void Connections::accept_later() {
  retry_.expires_after(kRetryAfter);
  retry_.async_wait([this](ErrorCode error) {
    if (!error && acceptor_.is_open()) accept();
  });
}

void Connections::close() {
  ErrorCode ignored;
  acceptor_.close(ignored);
  retry_.cancel();
}

void Connections::when_idle(std::function<void()> idle) {
  if (answering_ == 0) return idle();
  idle_ = std::move(idle);
}

void Connections::answer_ends() {
  if (--answering_ == 0 && idle_) std::exchange(idle_, {})();
}

}  // namespace bslam::web_server
