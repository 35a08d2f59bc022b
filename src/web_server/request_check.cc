#include "web_server/request_check.h"

#include <algorithm>
#include <array>
#include <random>

namespace bslam::web_server {
namespace {

bool equal_in_constant_time(std::string_view a, std::string_view b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    difference |= static_cast<unsigned>(a[i]) ^ static_cast<unsigned>(b[i]);
  return difference == 0;
}

// The value of the first parameter `token` of a query; empty if there is none.
std::string_view token_of(std::string_view target) {
  constexpr std::string_view kName = "token=";
  std::size_t at = target.find('?');
  while (at != std::string_view::npos) {
    const std::string_view rest = target.substr(at + 1);
    if (rest.substr(0, kName.size()) == kName) return rest.substr(kName.size(), rest.find('&') - kName.size());
    at = target.find('&', at + 1);
  }
  return {};
}

bool consists_of(std::string_view text, std::string_view characters) {
  return !text.empty() && text.find_first_not_of(characters) == std::string_view::npos;
}

}  // namespace

std::string make_token() {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::random_device source;  // the random source of the operating system
  std::string token;
  for (int i = 0; i < 4; ++i) {
    const unsigned bits = source();
    for (unsigned shift = 0; shift < 32; shift += 4) token += kDigits[(bits >> shift) & 15U];
  }
  return token;
}

std::string_view path_of(std::string_view target) { return target.substr(0, target.find('?')); }

bool is_own_host(std::string_view host, bool loopback) {
  const std::size_t bracket = host.find(']');
  const std::size_t colon = host.find(':', bracket == std::string_view::npos ? 0 : bracket);
  const std::string_view name = host.substr(0, colon);
  const std::string_view port = colon == std::string_view::npos ? "0" : host.substr(colon + 1);
  if (!consists_of(port, "0123456789")) return false;
  if (name == "localhost" || name == "[::1]") return true;
  const bool ipv4 = consists_of(name, "0123456789.") && std::ranges::count(name, '.') == 3;
  if (loopback) return ipv4 && name.starts_with("127.");
  const bool ipv6 = name.size() > 2 && name.front() == '[' && name.back() == ']' &&
                    consists_of(name.substr(1, name.size() - 2), "0123456789abcdefABCDEF:.");
  return ipv6 || ipv4;
}

bool is_allowed(const RequestHead& head, std::string_view token, bool loopback) {
  if (token.empty() || !is_own_request(head, loopback)) return false;
  return equal_in_constant_time(token_of(head.target), token);
}

bool is_own_request(const RequestHead& head, bool loopback) {
  if (!is_own_host(head.host, loopback)) return false;
  return head.origin.empty() || head.origin == "http://" + std::string(head.host);
}

bool has_bearer_token(const RequestHead& head, std::string_view token) {
  constexpr std::string_view kScheme = "Bearer ";
  const bool bearer = head.authorization.substr(0, kScheme.size()) == kScheme;
  return bearer && !token.empty() && equal_in_constant_time(head.authorization.substr(kScheme.size()), token);
}

}  // namespace bslam::web_server
