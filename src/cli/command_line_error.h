// Converts errors of the command line parser to the error type of the program.
#pragma once

#include <CLI/CLI.hpp>

#include "base/result.h"

namespace bslam::cli {

// Names the first unknown command or option, and suggests an existing one if its name is close. Other errors are
// reported with the message of the parser.
Error command_line_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace bslam::cli
