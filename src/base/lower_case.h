// Letters in texts whose case does not matter.
#pragma once

#include <algorithm>
#include <string>

namespace bslam {

// Returns the text with the letters A to Z in lower case, in any locale.
inline std::string lower_case(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return text;
}

}  // namespace bslam
