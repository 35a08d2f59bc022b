// Messages on stderr. One that cannot be written, for example because the disk with the log is full, is lost; it is no
// reason to end the command.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <utility>

namespace bslam::cli {

// Formats like fmt::print, and writes the text in one piece, so that messages of several threads do not mix.
template <typename... T>
void print_message(fmt::format_string<T...> text, T&&... values) {
  std::fputs(fmt::format(text, std::forward<T>(values)...).c_str(), stderr);
}

}  // namespace bslam::cli
