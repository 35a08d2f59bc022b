// Commands that are printed for the user to copy into a shell.
#pragma once

#include <string>
#include <vector>

namespace bslam::cli {

// Returns the words separated by spaces, quoted if a POSIX shell requires it.
std::string shell_command(const std::vector<std::string>& words);

}  // namespace bslam::cli
