// The terminal output of `bslam run`. All of its content is also in the summary.
#pragma once

#include <string>
#include <vector>

#include "session/run_record.h"

namespace bslam::cli {

// Prints warnings (session/run_warnings.h) to stderr, one per line.
void print_warnings(const std::vector<std::string>& warnings);

// Prints to stdout how many frames have a pose, the size of the map, the verdict about the calibration, and where the
// files are.
void print_result(const session::RunRecord& record, const std::string& out);

}  // namespace bslam::cli
