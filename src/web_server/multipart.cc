#include "web_server/multipart.h"

#include <algorithm>
#include <optional>
#include <string>

#include "base/lower_case.h"

namespace bslam::web_server {
namespace {

constexpr std::string_view kEndOfLine = "\r\n";
constexpr std::size_t kMaxBoundary = 70;  // RFC 2046

bool is_word(std::string_view text, std::string_view in_lower_case) {
  return text.size() == in_lower_case.size() && lower_case(std::string(text)) == in_lower_case;
}

std::string_view without_blanks(std::string_view text) {
  constexpr std::string_view kBlanks = " \t";
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) + 1 - begin);
}

// The value of a header, such as `form-data; name="cam0"`: what stands before the first semicolon.
std::string_view kind_of(std::string_view value) { return without_blanks(value.substr(0, value.find(';'))); }

// The length of the parameter that the text begins with: up to a semicolon that is not between quotation marks.
std::size_t length_of_parameter(std::string_view text) {
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') quoted = !quoted;
    if (text[i] == ';' && !quoted) return i;
  }
  return text.size();
}

// The value of a parameter of a header, without quotation marks; nullopt if it is missing.
std::optional<std::string_view> parameter(std::string_view value, std::string_view name) {
  std::size_t at = value.find(';');
  while (at < value.size()) {
    const std::string_view rest = value.substr(at + 1);
    const std::size_t length = length_of_parameter(rest);
    const std::string_view text = rest.substr(0, length);
    const std::size_t sign = text.find('=');
    if (sign != std::string_view::npos && is_word(without_blanks(text.substr(0, sign)), name)) {
      const std::string_view found = without_blanks(text.substr(sign + 1));
      const bool quoted = found.size() >= 2 && found.front() == '"' && found.back() == '"';
      return quoted ? found.substr(1, found.size() - 2) : found;
    }
    at += 1 + length;
  }
  return std::nullopt;
}

Error damaged(const char* found, const char* expected) { return {"form", "", found, expected}; }

// The name of the field, from the header of its part: lines without the last end of line.
Result<std::string_view> name_in(std::string_view header) {
  constexpr std::string_view kDisposition = "content-disposition";
  while (!header.empty()) {
    const std::size_t end = std::min(header.find(kEndOfLine), header.size());
    const std::string_view line = header.substr(0, end);
    header.remove_prefix(std::min(header.size(), end + kEndOfLine.size()));
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos || !is_word(line.substr(0, colon), kDisposition)) continue;
    const std::string_view value = line.substr(colon + 1);
    const auto name = parameter(value, "name");
    if (is_word(kind_of(value), "form-data") && name && !name->empty()) return *name;
    break;
  }
  return damaged("a part without a name", "Content-Disposition: form-data with a name in every part");
}

Result<std::string> boundary_of(std::string_view content_type) {
  if (!is_word(kind_of(content_type), "multipart/form-data"))
    return Error{"request", "Content-Type", content_type.empty() ? "nothing" : "another type", "multipart/form-data"};
  const auto boundary = parameter(content_type, "boundary");
  if (!boundary || boundary->empty() || boundary->size() > kMaxBoundary)
    return Error{"request", "Content-Type", boundary && !boundary->empty() ? "a long boundary" : "no boundary",
                 "a boundary of 1 to 70 characters"};
  return std::string(*boundary);
}

// Takes a part, after the line of its boundary, and the boundary that ends it.
Result<FormPart> take_part(std::string_view& rest, const std::string& delimiter, const FormLimits& limits) {
  constexpr std::string_view kEndOfHeader = "\r\n\r\n";
  const std::size_t header = rest.substr(0, limits.header_bytes + kEndOfHeader.size()).find(kEndOfHeader);
  if (header == std::string_view::npos)
    return Error{"form", "", "a part whose header does not end",
                 "an empty line after at most " + std::to_string(limits.header_bytes) + " bytes"};
  const auto name = name_in(rest.substr(0, header));
  if (!name) return name.error();
  rest.remove_prefix(header + kEndOfHeader.size());
  const std::size_t end = rest.find(delimiter);
  if (end == std::string_view::npos) return damaged("a part that does not end", "the boundary after every part");
  const FormPart part{*name, rest.substr(0, end)};
  rest.remove_prefix(end + delimiter.size());
  return part;
}

}  // namespace

Result<std::vector<FormPart>> parse_form(std::string_view content_type, std::string_view body,
                                         const FormLimits& limits) {
  const auto boundary = boundary_of(content_type);
  if (!boundary) return boundary.error();
  const std::string delimiter = "\r\n--" + *boundary;
  if (body.substr(0, delimiter.size() - 2) != std::string_view(delimiter).substr(2))
    return damaged("a body that does not begin with the boundary", "the boundary of Content-Type");
  std::string_view rest = body.substr(delimiter.size() - 2);
  std::vector<FormPart> parts;
  while (rest.substr(0, 2) != "--") {
    if (rest.substr(0, 2) != kEndOfLine) return damaged("a boundary without an end of line", "a complete form");
    if (parts.size() == limits.parts)
      return Error{"form", "", "more than " + std::to_string(limits.parts) + " parts", "at most so many"};
    rest.remove_prefix(2);
    auto part = take_part(rest, delimiter, limits);
    if (!part) return part.error();
    parts.push_back(*part);
  }
  if (rest != "--" && rest != "--\r\n") return damaged("bytes after the last boundary", "the end of the form");
  return parts;
}

}  // namespace bslam::web_server
