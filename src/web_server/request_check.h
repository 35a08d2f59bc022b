// Which requests a server answers. Web pages of other origins can send requests to a server on this machine, with any
// name of a host that resolves to it (DNS rebinding): the token, the Host header and the Origin header are checked.
#pragma once

#include <string>
#include <string_view>

namespace bslam::web_server {

// 32 hexadecimal digits from the operating system's random number generator.
std::string make_token();

// The request line and headers of a request. Missing headers are empty.
struct RequestHead {
  std::string_view target;  // path and query, as sent
  std::string_view host = {};
  std::string_view origin = {};
  std::string_view method = {};
  std::string_view authorization = {};
  std::string_view content_type = {};
  bool websocket = false;  // asks for a WebSocket connection
};

// Whether the query of the target contains the token, the host is this machine (see is_own_host), and the origin, if
// given, is that of the host. The time of the comparison does not depend on the token.
bool is_allowed(const RequestHead& head, std::string_view token, bool loopback);

// Whether the request comes from a program or from a page of this server, as the Host and Origin headers say: the host
// is this machine (see is_own_host), and the origin, if given, is that of the host.
bool is_own_request(const RequestHead& head, bool loopback);

// Whether the Authorization header is "Bearer " and the token. The time of the comparison does not depend on the token.
bool has_bearer_token(const RequestHead& head, std::string_view token);

// Whether a Host header names this machine: with `loopback`, as localhost or by a loopback address; else as localhost
// or by any IP address. Other names could be those of another site. The port does not matter: it may be forwarded.
bool is_own_host(std::string_view host, bool loopback);

// The path of a target, without the query.
std::string_view path_of(std::string_view target);

}  // namespace bslam::web_server
