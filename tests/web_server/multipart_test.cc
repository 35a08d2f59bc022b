#include "web_server/multipart.h"

#include <gtest/gtest.h>

#include <string>

namespace bslam::web_server {
namespace {

constexpr const char* kType = "multipart/form-data; boundary=XyZ";

std::string part(const std::string& name, const std::string& content) {
  return "--XyZ\r\nContent-Disposition: form-data; name=\"" + name +
         "\"; filename=\"a.png\"\r\nContent-Type: image/png" + "\r\n\r\n" + content + "\r\n";
}

std::string message(const std::string& type, const std::string& body, const FormLimits& limits = {}) {
  const auto parts = parse_form(type, body, limits);
  return parts ? "" : parts.error().message();
}

TEST(Multipart, PartsHaveTheirNamesAndEveryByteOfTheirContent) {
  const std::string binary("\r\n--Xy\0--XyY\r\n\r\n--", 18);
  const std::string body = part("cam0", binary) + part("cam1", "") + "--XyZ--\r\n";
  for (const char* type :
       {kType, "multipart/form-data; boundary=\"XyZ\"", "Multipart/Form-Data; charset=x; BOUNDARY=XyZ"}) {
    const auto parts = parse_form(type, body);
    ASSERT_TRUE(parts) << parts.error().message();
    ASSERT_EQ(parts->size(), 2u);
    EXPECT_EQ((*parts)[0].name, "cam0");
    EXPECT_EQ((*parts)[0].content, binary);
    EXPECT_EQ((*parts)[1].name, "cam1");
    EXPECT_EQ((*parts)[1].content, "");
  }
  EXPECT_TRUE(parse_form(kType, "--XyZ--")->empty());
}

TEST(Multipart, NamesOfFilesDoNotMatter) {
  const std::string body =
      "--XyZ\r\nX: y\r\ncontent-disposition:form-data; filename=\"a; name=\\\"no\\\"; b\" ; "
      "name=yes\r\n\r\n1\r\n--XyZ--";
  const auto parts = parse_form(kType, body);
  ASSERT_TRUE(parts) << parts.error().message();
  EXPECT_EQ(parts->front().name, "yes");
}

TEST(Multipart, ATruncatedBodyIsAnErrorAtEveryLength) {
  const std::string body = part("cam0", "pixels") + part("cam1", "more") + "--XyZ--";
  for (std::size_t length = 0; length < body.size(); ++length)
    EXPECT_FALSE(parse_form(kType, body.substr(0, length))) << length;
  EXPECT_TRUE(parse_form(kType, body));
}

TEST(Multipart, OtherTypesAndBoundariesAreRefused) {
  const std::string body = part("cam0", "pixels") + "--XyZ--";
  EXPECT_EQ(message("", body), "request: Content-Type: found nothing, expected multipart/form-data");
  EXPECT_EQ(message("image/png", body), "request: Content-Type: found another type, expected multipart/form-data");
  EXPECT_EQ(message("multipart/form-data", body),
            "request: Content-Type: found no boundary, expected a boundary of 1 to 70 characters");
  EXPECT_EQ(message("multipart/form-data; boundary=", body),
            "request: Content-Type: found no boundary, expected a boundary of 1 to 70 characters");
  EXPECT_EQ(message("multipart/form-data; boundary=" + std::string(71, 'x'), body),
            "request: Content-Type: found a long boundary, expected a boundary of 1 to 70 characters");
  EXPECT_EQ(message("multipart/form-data; boundary=other", body),
            "form: found a body that does not begin with the boundary, expected the boundary of Content-Type");
}

TEST(Multipart, DamagedPartsAreRefused) {
  EXPECT_EQ(message(kType, "--XyZ\r\nContent-Type: image/png\r\n\r\n1\r\n--XyZ--"),
            "form: found a part without a name, expected Content-Disposition: form-data with a name in every part");
  EXPECT_FALSE(parse_form(kType, "--XyZ\r\nContent-Disposition: form-data; name=\"\"\r\n\r\n1\r\n--XyZ--"));
  EXPECT_FALSE(parse_form(kType, "--XyZ\r\nContent-Disposition: attachment; name=a\r\n\r\n1\r\n--XyZ--"));
  EXPECT_FALSE(parse_form(kType, "--XyZ\r\n\r\n1\r\n--XyZ--"));
  EXPECT_FALSE(parse_form(kType, "--XyZ" + part("a", "1") + "--XyZ--"));
  EXPECT_EQ(message(kType, part("a", "1") + "--XyZ--more"),
            "form: found bytes after the last boundary, expected the end of the form");
}

TEST(Multipart, NumberOfPartsAndLengthOfHeadersAreLimited) {
  std::string many;
  for (int i = 0; i < 5000; ++i) many += part("cam0", "x");
  EXPECT_EQ(message(kType, many + "--XyZ--", {.parts = 4}), "form: found more than 4 parts, expected at most so many");
  const std::string name(100000, 'n');
  EXPECT_EQ(message(kType, part(name, "x") + "--XyZ--"),
            "form: found a part whose header does not end, expected an empty line after at most 2048 bytes");
}

}  // namespace
}  // namespace bslam::web_server
