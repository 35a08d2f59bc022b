#include "web_server/server.h"

#include <algorithm>
#include <atomic>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <functional>
#include <future>
#include <list>
#include <thread>
#include <utility>

#include "base/this_thread.h"
#include "web_server/http_connection.h"
#include "web_server/request_check.h"

namespace bslam::web_server {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using ErrorCode = boost::system::error_code;
using SharedText = std::shared_ptr<const std::string>;

constexpr double kMaxShare = 0.03;  // maximum fraction of a core's time that updates of a channel may take

}  // namespace

struct LatestUpdate {
  SharedText text;
  std::uint64_t version = 0;  // 0: none
};

// The part of the server that connections use. All of it runs in one thread.
struct Hub {
  Content& content;
  std::vector<Channel> channels;
  std::vector<LatestUpdate> latest = std::vector<LatestUpdate>(channels.size());  // by channel
  bool finishing = false;
  std::list<class Viewer*> viewers = {};
  std::function<void()> viewers_changed = {};
  std::function<void()> answered = {};  // a message was received
};

// A browser that gets updates.
class Viewer : public std::enable_shared_from_this<Viewer> {
 public:
  Viewer(Hub& hub, Socket socket, Slot slot)
      : hub_(hub), slot_(std::move(slot)), socket_(std::move(socket)), sent_(hub.channels.size()) {}
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
  const Slot slot_;
  websocket::stream<beast::tcp_stream> socket_;
  Request request_;
  beast::flat_buffer buffer_;
  std::vector<Sent> sent_;  // by channel
  std::deque<SharedText> queue_;
  SharedText writing_;  // being sent
  bool listed_ = false, closing_ = false;
};

class Server::Implementation final : public RequestHandler {
 public:
  Implementation(std::vector<Channel> channels, Content& content)
      : hub_{.content = content, .channels = std::move(channels)},
        connections_({.connections = kMaxConnections}, *this, [this](Request request, Socket socket, Slot slot) {
          std::make_shared<Viewer>(hub_, std::move(socket), std::move(slot))->accept(std::move(request));
        }) {
    hub_.viewers_changed = [this] { on_viewers_changed(); };
    hub_.answered = [this] {
      for (std::size_t c = 0; c < hub_.channels.size(); ++c) {
        if (hub_.channels[c].answers) refresh(c);
      }
    };
    for (std::size_t c = 0; c < hub_.channels.size(); ++c) timers_.emplace_back(connections_.context());
    ticking_.resize(hub_.channels.size());
  }

  ~Implementation() override {
    connections_.context().stop();
    if (thread_.joinable()) thread_.join();
    hub_.viewers_changed = {};
  }

  Status listen(const ServerOptions& options) {
    if (const Status s = connections_.listen(options); !s) return s;
    url_ = connections_.url() + "/?token=" + token_;
    thread_ = std::thread([this] { run(); });
    return {};
  }

  std::optional<Response> refuse(const RequestHead& head) override {
    if (!is_allowed(head, token_, connections_.loopback()))
      return Response{403, "Open the address that bslam has printed, with its token.\n"};
    if (path_of(head.target) == "/live" && head.websocket) return std::nullopt;
    if (head.method != "GET") return Response{405, "This server answers GET only.\n"};
    if (path_of(head.target) != "/") return Response{404, "There is nothing here.\n"};
    return std::nullopt;
  }

  void handle(const RequestHead& head, std::string, Respond respond) override {
    // The page consists of one file, and has a connection to this server only.
    const std::string policy =
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
        "connect-src 'self' ws://" +
        std::string(head.host) + "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    respond({200, hub_.content.page(), "text/html; charset=utf-8", {{"Content-Security-Policy", policy}}});
  }

  const std::string& url() const { return url_; }
  bool is_watched() const { return is_watched_; }

  void finish(std::chrono::milliseconds limit) {
    std::future<void> finished = finished_.get_future();
    asio::post(connections_.context(), [this] { begin_finish(); });
    finished.wait_for(limit);
  }

 private:
  void run() {
    lower_thread_priority();
    try {
      connections_.context().run();
    } catch (const std::exception&) {  // such as a lack of memory: whoever has a server does not depend on it
      connections_.close();
      set_finished();
    }
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

  // Sends the newest update of a channel to the browsers that are ready, repeatedly while there are viewers.
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
    connections_.close();
    if (hub_.viewers.empty()) return set_finished();
    for (std::size_t c = 0; c < hub_.channels.size(); ++c) refresh(c);
    for (Viewer* viewer : hub_.viewers) viewer->close_after_sending();
  }

  void set_finished() {
    if (!std::exchange(is_finished_, true)) finished_.set_value();
  }

  Hub hub_;  // declared first: connections that are destroyed use it
  const std::string token_ = make_token();
  Connections connections_;
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
