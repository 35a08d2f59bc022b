#include "web_server/request_check.h"

#include <gtest/gtest.h>

namespace bslam::web_server {
namespace {

constexpr std::string_view kToken = "0123456789abcdef0123456789abcdef";

TEST(RequestCheck, ARequestNeedsTheWholeToken) {
  const auto allowed = [](const std::string& query) {
    return is_allowed({"/" + query, "127.0.0.1:8642", ""}, kToken, true);
  };
  EXPECT_TRUE(allowed("?token=" + std::string(kToken)));
  EXPECT_TRUE(allowed("?a=1&token=" + std::string(kToken) + "&b=2"));
  EXPECT_FALSE(allowed(""));
  EXPECT_FALSE(allowed("?token="));
  EXPECT_FALSE(allowed("?token=" + std::string(kToken.substr(1))));
  EXPECT_FALSE(allowed("?token=" + std::string(kToken) + "0"));
  EXPECT_FALSE(allowed("?xtoken=" + std::string(kToken)));
  EXPECT_FALSE(allowed("?token=1&token=" + std::string(kToken)));
  EXPECT_FALSE(is_allowed({"/?token=", "127.0.0.1", ""}, "", true));
}

TEST(RequestCheck, OtherNamesOfTheHostAreRefused) {
  for (const char* host : {"127.0.0.1", "127.0.0.1:80", "127.0.1.1:80", "localhost:8642", "[::1]:8642"}) {
    EXPECT_TRUE(is_own_host(host, true)) << host;
    EXPECT_TRUE(is_own_host(host, false)) << host;
  }
  for (const char* host :
       {"", "evil.example", "evil.example:8642", "127.0.0.1.evil.example", "localhost.evil.example:1",
        "127.0.0.1:80@evil.example", "127.0.0.1:", "[::1]x", "1.2.3", "[]", "[::1"}) {
    EXPECT_FALSE(is_own_host(host, true)) << host;
    EXPECT_FALSE(is_own_host(host, false)) << host;
  }
  for (const char* host : {"192.168.1.7:8642", "10.0.0.1", "[fe80::1]:8642"}) {
    EXPECT_FALSE(is_own_host(host, true)) << host;
    EXPECT_TRUE(is_own_host(host, false)) << host;
  }
}

TEST(RequestCheck, TheOriginIsThatOfTheHost) {
  const std::string target = "/live?token=" + std::string(kToken);
  EXPECT_TRUE(is_allowed({target, "127.0.0.1:8642", "http://127.0.0.1:8642"}, kToken, true));
  for (const char* origin : {"http://evil.example", "https://127.0.0.1:8642", "http://127.0.0.1:80", "null"})
    EXPECT_FALSE(is_allowed({target, "127.0.0.1:8642", origin}, kToken, true)) << origin;
}

TEST(RequestCheck, ABearerTokenIsComparedAsAWhole) {
  const auto allowed = [](const std::string& authorization) {
    return has_bearer_token({.target = "/", .authorization = authorization}, kToken);
  };
  EXPECT_TRUE(allowed("Bearer " + std::string(kToken)));
  for (const std::string& wrong :
       {std::string(), std::string("Bearer "), "bearer " + std::string(kToken), std::string(kToken),
        "Bearer " + std::string(kToken) + "0", "Bearer " + std::string(kToken.substr(1))})
    EXPECT_FALSE(allowed(wrong)) << wrong;
  EXPECT_FALSE(has_bearer_token({.target = "/", .authorization = "Bearer "}, ""));
}

TEST(RequestCheck, TokensDiffer) {
  const std::string a = make_token(), b = make_token();
  EXPECT_EQ(a.size(), 32u);
  EXPECT_EQ(a.find_first_not_of("0123456789abcdef"), std::string::npos);
  EXPECT_NE(a, b);
}

}  // namespace
}  // namespace bslam::web_server
