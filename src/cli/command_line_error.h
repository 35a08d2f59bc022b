// Converts errors of the command line parser to the error type of the program.
#pragma once

#include <CLI/CLI.hpp>
#include <string_view>

#include "base/result.h"

namespace bslam::cli {

// Makes empty values of options and arguments errors, in this command and those below it. They come from variables of a
// shell that are not set, and would count as options that were not given.
void refuse_empty_values(CLI::App& app);

// Follows "Value ..." in the message of a check for numbers that are not finite.
constexpr std::string_view kNotFinite = " is not finite";

// Names the first unknown command or option, and suggests an existing one if its name is close. Other errors are
// reported with the message of the parser.
Error command_line_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace bslam::cli
