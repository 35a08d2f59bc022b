// Converts errors of the command line parser to the error type of the program.
#pragma once

#include <CLI/CLI.hpp>
#include <string_view>

#include "base/result.h"

namespace bslam::cli {

// Messages of cli/option_values.h for the value of an option; the second one follows "Value ...".
constexpr std::string_view kEmptyValue = "empty value", kNotFinite = " is not finite";

// Names the first unknown command or option, and suggests an existing one if its name is close. Other errors are
// reported with the message of the parser.
Error command_line_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace bslam::cli
