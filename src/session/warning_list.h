// Lists of warnings and how a warning is added.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

namespace bslam::session {

using Warnings = std::vector<std::string>;

template <class... Values>
void warn(Warnings& warnings, fmt::format_string<Values...> text, Values&&... values) {
  warnings.push_back(fmt::format(text, std::forward<Values>(values)...));
}

}  // namespace bslam::session
