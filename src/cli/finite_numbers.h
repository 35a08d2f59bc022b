// Numbers on the command line are finite.
#pragma once

#include <CLI/CLI.hpp>

namespace bslam::cli {

// The parser accepts "nan" and "inf" as numbers, and NaN in any range. Makes both errors in all options of this command
// and of those below it.
void refuse_infinite_numbers(CLI::App& app);

}  // namespace bslam::cli
