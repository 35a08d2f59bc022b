// Shows the result of a run in Rerun, by the Python package.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"

namespace bslam::cli {

// Whether the target of --rerun is the address of a viewer, such as rerun+http://127.0.0.1:9876/proxy, or else a file.
bool is_viewer(const std::string& target);

// Checks before a run whether Python finds the packages, and whether the viewer, if the target is one, can be reached.
// The interpreter is python3, or $BSLAM_PYTHON.
Status check_rerun(const std::string& target);

// Sends the run in this folder, with its report, to the target. Error: it cannot be reached or written.
Status send_to_rerun(const std::filesystem::path& folder, const std::string& target);

}  // namespace bslam::cli
