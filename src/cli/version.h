// The output of `bslam --version`.
#pragma once

#include <string>

namespace bslam::cli {

// Returns several lines: version, git revision, compiler, and the versions of the linked libraries.
std::string version_text();

// Returns only the version, such as "0.1.0".
std::string version_number();

}  // namespace bslam::cli
