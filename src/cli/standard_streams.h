// The files that every process has: stdin, stdout and stderr.
#pragma once

#include "base/result.h"

namespace bslam::cli {

// Opens /dev/null in place of those that are closed: otherwise the next file that is opened would take their number,
// and what is printed would be written into it.
void open_standard_streams();

// Writes what is left to stdout. Error: a part of the output was not written.
Status finish_stdout();

}  // namespace bslam::cli
