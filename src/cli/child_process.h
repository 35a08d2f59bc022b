// Runs another process and waits for it.
#pragma once

#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"

namespace bslam::cli {

// How a process ended: with an exit status, or by a signal (then `signal` is positive).
struct ProcessEnd {
  int exit_status = 0;
  int signal = 0;
};

// The program that calls run_program(), which starts it again under the name "bslam".
constexpr const char* kThisProgram = "/proc/self/exe";

// Runs a program, which is looked for in PATH unless its name contains a slash, with the given arguments (without its
// name), with stdout and stderr in `log`, and waits for its end. When a stop is requested, the process receives SIGINT.
// Error: the process cannot be started, or its end is not known.
Result<ProcessEnd> run_program(const std::string& program, const std::vector<std::string>& arguments,
                               const std::filesystem::path& log, const std::stop_token& stop = {});

}  // namespace bslam::cli
