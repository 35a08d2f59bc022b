// Checks XML as written by figure_svg: one root, tags that close in order, attributes in quotes, no stray < or
// &.
#pragma once

#include <cctype>
#include <string>
#include <string_view>
#include <vector>

namespace bslam::report {

// Returns a description of the first error, or an empty string.
inline std::string xml_fault(std::string_view text) {
  std::vector<std::string> open;
  bool rooted = false;
  while (!text.empty()) {
    const std::size_t tag = text.find('<');
    for (std::size_t amp = text.find('&'); amp < tag && amp != std::string_view::npos; amp = text.find('&', amp + 1)) {
      bool known = false;
      for (const std::string_view entity : {"&amp;", "&lt;", "&gt;", "&quot;"})
        known |= text.substr(amp).starts_with(entity);
      if (!known) return "stray &";
    }
    if (text.substr(0, tag).find('>') != std::string_view::npos) return "stray >";
    if (tag == std::string_view::npos) break;
    text.remove_prefix(tag);
    const std::size_t end = text.find('>');
    if (end == std::string_view::npos) return "tag without end";
    const std::string_view inside = text.substr(1, end - 1);
    text.remove_prefix(end + 1);
    if (inside.find('<') != std::string_view::npos) return "< in a tag";
    if (inside.starts_with('?')) continue;
    if (inside.starts_with('/')) {
      if (open.empty() || open.back() != inside.substr(1)) return "closes " + std::string(inside.substr(1));
      open.pop_back();
      continue;
    }
    int quotes = 0;
    for (const char c : inside) quotes += c == '"';
    if (quotes % 2 != 0) return "odd quotes in " + std::string(inside);
    if (open.empty() && rooted) return "second root";
    rooted = true;
    if (!inside.ends_with('/')) open.emplace_back(inside.substr(0, inside.find_first_of(" \n")));
  }
  if (!open.empty()) return "left open: " + open.back();
  return rooted ? "" : "no root";
}

}  // namespace bslam::report
