// Shows a page in web browsers, and sends them updates of it: HTTP and WebSocket in one thread with low priority.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "web_server/http_server.h"

namespace bslam::web_server {

// What a server shows. All functions are called by the thread of the server.
class Content {
 public:
  virtual ~Content() = default;

  // Returns the page with the current data.
  virtual std::string page() = 0;
  // The newest update of a channel, as text, or nullopt if nothing has changed since the last call. Called only if a
  // browser is ready for it.
  virtual std::optional<std::string> update(std::size_t channel) = 0;
  // A message from a browser: any text of at most kMaxMessage bytes.
  virtual void received(std::string_view message) = 0;
};

inline constexpr std::size_t kMaxMessage = 256;     // bytes; a longer message closes its connection
inline constexpr std::size_t kMaxConnections = 16;  // further ones are closed at once

// Updates of a channel replace each other: a browser gets the newest one when it has confirmed the previous one by the
// message "got NAME". A slow browser thus misses updates.
struct Channel {
  std::string name;
  std::chrono::milliseconds interval;  // between updates, at least
  bool answers = false;                // updated after every message from a browser as well
};

class Server {
 public:
  // Begins to listen, and to answer. Without the token of url() every request is answered with 403 (Forbidden).
  // `content` must outlive the server. Errors, with the keys "address" and "port": the address is not that of an
  // interface, the port is in use or not permitted.
  static Result<std::unique_ptr<Server>> start(const ServerOptions& options, std::vector<Channel> channels,
                                               Content& content);
  // Closes all connections.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  const std::string& url() const;  // with the token
  bool is_watched() const;         // by a browser that gets updates; thread-safe

  // Sends the newest update of all channels, and closes the connections of all browsers that have received them. Waits
  // for them, if there are any, for at most `limit`.
  void finish(std::chrono::milliseconds limit);

 private:
  class Implementation;
  explicit Server(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace bslam::web_server
