// What `bslam --version` says.
#pragma once

#include <string>

namespace bslam::cli {

// Several lines: version, git revision, compiler, and the versions of what is linked.
std::string version_text();

// The version alone, "0.1.0".
std::string version_number();

}  // namespace bslam::cli
