// Values that no option of a command may have.
#pragma once

#include <CLI/CLI.hpp>

namespace bslam::cli {

// Makes values errors that the parser accepts, in all options and arguments of this command and of those below it:
// empty ones, which come from variables of a shell that are not set and would count as options that were not given, and
// the numbers "nan" and "inf", of which the first one is in any range.
void check_option_values(CLI::App& app);

}  // namespace bslam::cli
