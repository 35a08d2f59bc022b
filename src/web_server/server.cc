#include "web_server/server.h"

#include <algorithm>
#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <functional>
#include <future>
#include <list>
#include <thread>
#include <utility>

#include "web_server/request_check.h"
#include "web_server/server_thread.h"

namespace bslam::web_server {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using ErrorCode = boost::system::error_code;
using SharedText = std::shared_ptr<const std::string>;
using Request = http::request<http::empty_body>;

constexpr std::uint32_t kMaxHeader = 16 * 1024;
constexpr auto kRequestTime = std::chrono::seconds(10);
constexpr auto kResponseTime = std::chrono::seconds(30);
constexpr int kSendBuffer = 256 * 1024;  // bytes; more would only delay what is newest
constexpr double kMaxShare = 0.03;       // of the processor time of a core that updates of a channel may take

std::string_view view(boost::string_view text) { return {text.data(), text.size()}; }

struct LatestUpdate {
  SharedText text;
  std::uint64_t version = 0;  // 0: none
};

// What connections need of the server. All of it runs in one thread.
struct Hub {
  Content& content;
  std::vector<Channel> channels;
  std::vector<LatestUpdate> latest = std::vector<LatestUpdate>(channels.size());  // by channel
  std::string token = make_token();
  bool loopback = true;
  bool finishing = false;
  std::size_t connections = 0;
  std::list<class Viewer*> viewers = {};
  std::function<void()> viewers_changed = {};
  std::function<void()> answered = {};  // a message was received
};

// Counts a connection as long as it lives.
class Counted {
 public:
  explicit Counted(Hub& hub) : hub_(hub) { ++hub_.connections; }
  ~Counted() { --hub_.connections; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;

 private:
  Hub& hub_;
};

// A browser that gets updates.
class Viewer : public std::enable_shared_from_this<Viewer> {
 public:
  Viewer(Hub& hub, tcp::socket socket)
      : hub_(hub), counted_(hub), socket_(std::move(socket)), sent_(hub.channels.size()) {}
  ~Viewer() {
    if (listed_) hub_.viewers.remove(this);
    if (listed_ && hub_.viewers_changed) hub_.viewers_changed();
  }

  void accept(Request request) {
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.read_message_max(kMaxMessage);
    socket_.text(true);
    request_ = std::move(request);
    socket_.async_accept(request_, [self = shared_from_this()](ErrorCode error) {
      if (!error) self->begin();
    });
  }

  bool is_ready(std::size_t channel) const { return !sent_[channel].in_flight; }

  // Sends the latest update of a channel if the browser is ready for it and does not have it.
  void offer(std::size_t channel) {
    const LatestUpdate& latest = hub_.latest[channel];
    Sent& sent = sent_[channel];
    if (latest.version == sent.version || (sent.in_flight && !hub_.finishing)) return;
    sent = {latest.version, true};
    queue_.push_back(latest.text);
    write();
  }

  // Ends the connection once everything was sent.
  void close_after_sending() { write(); }

 private:
  struct Sent {
    std::uint64_t version = 0;
    bool in_flight = false;  // not confirmed
  };

  void begin() {
    listed_ = true;
    hub_.viewers.push_back(this);
    hub_.viewers_changed();
    for (std::size_t c = 0; c < sent_.size(); ++c) offer(c);
    read();
  }

  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](ErrorCode error, std::size_t) {
      if (error) return;
      const auto bytes = self->buffer_.cdata();
      self->handle({static_cast<const char*>(bytes.data()), bytes.size()});
      self->buffer_.consume(self->buffer_.size());
      self->read();
    });
  }

  void handle(std::string_view message) {
    constexpr std::string_view kGot = "got ";
    if (message.substr(0, kGot.size()) != kGot) {
      hub_.content.received(message);
      return hub_.answered();
    }
    const auto channel = std::ranges::find(hub_.channels, message.substr(kGot.size()), &Channel::name);
    if (channel == hub_.channels.end()) return;
    const auto c = static_cast<std::size_t>(channel - hub_.channels.begin());
    sent_[c].in_flight = false;
    offer(c);
  }

  void write() {
    if (writing_) return;
    if (queue_.empty()) {
      if (hub_.finishing) close();
      return;
    }
    writing_ = queue_.front();
    queue_.pop_front();
    socket_.async_write(asio::buffer(*writing_), [self = shared_from_this()](ErrorCode error, std::size_t) {
      self->writing_.reset();
      if (!error) self->write();
    });
  }

  void close() {
    if (std::exchange(closing_, true)) return;
    socket_.async_close({websocket::close_code::normal, "ended"}, [self = shared_from_this()](ErrorCode) {});
  }

  Hub& hub_;
  const Counted counted_;
  websocket::stream<beast::tcp_stream> socket_;
  Request request_;
  beast::flat_buffer buffer_;
  std::vector<Sent> sent_;  // by channel
  std::deque<SharedText> queue_;
  SharedText writing_;  // being sent
  bool listed_ = false, closing_ = false;
};

// A connection that has sent no request yet, or is being answered.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Hub& hub, tcp::socket socket) : hub_(hub), counted_(hub), stream_(std::move(socket)) {
    parser_.header_limit(kMaxHeader);
    parser_.body_limit(0);
  }

  void read() {
    stream_.expires_after(kRequestTime);
    http::async_read(stream_, buffer_, parser_, [self = shared_from_this()](ErrorCode error, std::size_t) {
      if (!error) return self->answer(self->parser_.release());
      if (error.category() == http::make_error_code(http::error::bad_method).category() &&
          error != http::error::end_of_stream)
        self->respond(http::status::bad_request, "This is not a request that this server understands.\n");
    });
  }

 private:
  void answer(Request request) {
    const RequestHead head{view(request.target()), view(request[http::field::host]),
                           view(request[http::field::origin])};
    if (!is_allowed(head, hub_.token, hub_.loopback))
      return respond(http::status::forbidden, "Open the address that bslam has printed, with its token.\n");
    if (path_of(head.target) == "/live" && websocket::is_upgrade(request)) {
      stream_.expires_never();
      std::make_shared<Viewer>(hub_, stream_.release_socket())->accept(std::move(request));
      return;
    }
    if (request.method() != http::verb::get)
      return respond(http::status::method_not_allowed, "This server answers GET only.\n");
    if (path_of(head.target) != "/") return respond(http::status::not_found, "There is nothing here.\n");
    // The page consists of one file, and has a connection to this server only.
    const std::string policy =
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
        "connect-src 'self' ws://" +
        std::string(head.host) + "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    response_.set("Content-Security-Policy", policy);
    respond(http::status::ok, hub_.content.page(), "text/html; charset=utf-8");
  }

  void respond(http::status status, std::string body, const char* type = "text/plain; charset=utf-8") {
    response_.result(status);
    response_.set(http::field::content_type, type);
    response_.set(http::field::cache_control, "no-store");
    response_.set("Referrer-Policy", "no-referrer");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.keep_alive(false);
    response_.body() = std::move(body);
    response_.prepare_payload();
    stream_.expires_after(kResponseTime);
    http::async_write(stream_, response_, [self = shared_from_this()](ErrorCode, std::size_t) {
      ErrorCode ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    });
  }

  Hub& hub_;
  const Counted counted_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{kMaxHeader + 1024};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
};

}  // namespace

class Server::Implementation {
 public:
  Implementation(std::vector<Channel> channels, Content& content)
      : hub_{.content = content, .channels = std::move(channels)} {
    hub_.viewers_changed = [this] { on_viewers_changed(); };
    hub_.answered = [this] {
      for (std::size_t c = 0; c < hub_.channels.size(); ++c) {
        if (hub_.channels[c].answers) refresh(c);
      }
    };
    for (std::size_t c = 0; c < hub_.channels.size(); ++c) timers_.emplace_back(context_);
    ticking_.resize(hub_.channels.size());
  }

  ~Implementation() {
    context_.stop();
    if (thread_.joinable()) thread_.join();
    hub_.viewers_changed = {};
  }

  Status listen(const ServerOptions& options) {
    ErrorCode error;
    const asio::ip::address address = asio::ip::make_address(options.address, error);
    if (error) return Error{"web server", "address", options.address, "an IP address of this machine, such as 0.0.0.0"};
    hub_.loopback = address.is_loopback();
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
           std::to_string(acceptor_.local_endpoint().port()) + "/?token=" + hub_.token;
    accept();
    thread_ = std::thread([this] { run(); });
    return {};
  }

  const std::string& url() const { return url_; }
  bool is_watched() const { return is_watched_; }

  void finish(std::chrono::milliseconds limit) {
    std::future<void> finished = finished_.get_future();
    asio::post(context_, [this] { begin_finish(); });
    finished.wait_for(limit);
  }

 private:
  void run() {
    lower_priority();
    try {
      context_.run();
    } catch (const std::exception&) {  // such as a lack of memory: whoever has a server does not depend on it
      acceptor_.close();
      set_finished();
    }
  }

  ErrorCode open(const tcp::endpoint& endpoint) {
    ErrorCode error;
    if (acceptor_.is_open()) acceptor_.close();
    acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    return error;
  }

  void accept() {
    acceptor_.async_accept([this](ErrorCode error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error && hub_.connections < kMaxConnections && !hub_.finishing) {
        ErrorCode ignored;
        socket.set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
        socket.set_option(tcp::no_delay(true), ignored);
        std::make_shared<Connection>(hub_, std::move(socket))->read();
      }
      accept();
    });
  }

  void on_viewers_changed() {
    is_watched_ = !hub_.viewers.empty();
    if (hub_.viewers.empty()) {
      if (hub_.finishing) set_finished();
      return;
    }
    for (std::size_t c = 0; c < ticking_.size(); ++c) {
      if (!std::exchange(ticking_[c], 1)) tick(c);
    }
  }

  // Sends the newest update of a channel to those that are ready, again and again as long as there are viewers.
  void tick(std::size_t c) {
    ticking_[c] = !hub_.viewers.empty() && !hub_.finishing;
    if (!ticking_[c]) return;
    const double start_ms = thread_ms();
    if (std::ranges::any_of(hub_.viewers, [c](const Viewer* v) { return v->is_ready(c); })) refresh(c);
    const auto pause = std::chrono::milliseconds(static_cast<int>((thread_ms() - start_ms) / kMaxShare));
    timers_[c].expires_after(std::max(hub_.channels[c].interval, pause));
    timers_[c].async_wait([this, c](ErrorCode error) {
      if (!error) tick(c);
    });
  }

  void refresh(std::size_t c) {
    if (auto text = hub_.content.update(c)) {
      hub_.latest[c] = {std::make_shared<const std::string>(*std::move(text)), hub_.latest[c].version + 1};
    }
    for (Viewer* viewer : hub_.viewers) viewer->offer(c);
  }

  void begin_finish() {
    hub_.finishing = true;
    acceptor_.close();
    if (hub_.viewers.empty()) return set_finished();
    for (std::size_t c = 0; c < hub_.channels.size(); ++c) refresh(c);
    for (Viewer* viewer : hub_.viewers) viewer->close_after_sending();
  }

  void set_finished() {
    if (!std::exchange(is_finished_, true)) finished_.set_value();
  }

  Hub hub_;  // declared first: connections that the context destroys use it
  asio::io_context context_{1};
  tcp::acceptor acceptor_{context_};
  std::vector<asio::steady_timer> timers_;  // by channel, like the next one
  std::vector<char> ticking_;
  std::string url_;
  std::promise<void> finished_;
  bool is_finished_ = false;
  std::atomic<bool> is_watched_ = false;
  std::thread thread_;
};

Server::Server(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}
Server::~Server() = default;

Result<std::unique_ptr<Server>> Server::start(const ServerOptions& options, std::vector<Channel> channels,
                                              Content& content) {
  auto implementation = std::make_unique<Implementation>(std::move(channels), content);
  if (const Status s = implementation->listen(options); !s) return s.error();
  return std::unique_ptr<Server>(new Server(std::move(implementation)));
}

const std::string& Server::url() const { return implementation_->url(); }
bool Server::is_watched() const { return implementation_->is_watched(); }
void Server::finish(std::chrono::milliseconds limit) { implementation_->finish(limit); }

}  // namespace bslam::web_server
