// What is wrong with a command line, in the words of all other errors.
#pragma once

#include <CLI/CLI.hpp>

#include "base/result.h"

namespace bslam::cli {

// The first verb or else option nobody knows, with the nearest that exists; where all are known, what the parser says.
Error command_line_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace bslam::cli
