// Splits texts at a separator.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace bslam {

// Returns the parts before, between and after the separators: one part without any. Parts may be empty ("1,,2", "1,").
std::vector<std::string> split(std::string_view text, char separator);

}  // namespace bslam
