// The log lines of `bslam run` on stderr, selected by --log-level.
#pragma once

#include <string>

#include "session/run_record.h"

namespace bslam::cli {

// Each level includes the previous levels.
enum class LogVerbosity {
  kError,    // only errors, which end the run
  kWarning,  // warnings about input and results
  kInfo,     // processing time of every stage
  kDebug,    // outcome of every frame
};

// Converts "error", "warning", "info" or "debug".
LogVerbosity log_verbosity(const std::string& name);

// Prints to stderr one line per stage with the number of calls and the median, 95 % and maximum time per call.
void print_stage_statistics(const session::RunRecord& record);

// Prints to stderr one line per frame with its outcome, its inliers and its processing time.
void print_frames(const session::RunRecord& record);

}  // namespace bslam::cli
