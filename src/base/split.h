// Lists in texts.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace bslam {

// Returns the parts between separators, of which there is at least one; parts may be empty ("1,,2", "1,").
std::vector<std::string> split(std::string_view text, char separator);

}  // namespace bslam
