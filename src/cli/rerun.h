// Shows the result of a run in Rerun, by the Python package.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"

namespace bslam::cli {

// Checks before a run whether Python finds the packages. The interpreter is python3, or $BSLAM_PYTHON. Error: it does
// not.
Status check_rerun();

// Sends the run in this folder, with its report, to `target`: an address such as rerun+http://127.0.0.1:9876/proxy, or
// a file. Error: it cannot be reached or written.
Status send_to_rerun(const std::filesystem::path& folder, const std::string& target);

}  // namespace bslam::cli
