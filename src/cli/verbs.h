// One function per command, which adds the subcommand to the parser. After the chosen command has run, `exit_status`
// holds its exit status (0, 2, 3 or 130, see docs/cli.md).
#pragma once

#include <CLI/CLI.hpp>
#include <span>
#include <string>

#include "base/result.h"

namespace bslam::cli {

constexpr int kExitOk = 0, kExitBadInput = 2, kExitNothingTracked = 3, kExitInterrupted = 130;
constexpr int kExitFailed = 1;  // the program failed although the request was valid
constexpr int kExitWorse = 1;   // result of a comparison: slower than before, or a different amount of work

// `command_line`: the arguments of the program, which the report of a run shows.
void add_run(CLI::App& app, std::span<const char* const> command_line, int& exit_status);
void add_live(CLI::App& app, std::span<const char* const> command_line, int& exit_status);
void add_eval(CLI::App& app, int& exit_status);
void add_bench(CLI::App& app, int& exit_status);
void add_simulate(CLI::App& app, int& exit_status);
void add_data(CLI::App& app, int& exit_status);
void add_inspect(CLI::App& app, int& exit_status);
void add_rig(CLI::App& app, int& exit_status);
void add_rig_calibrate(CLI::App& rig, int& exit_status);
void add_vocab(CLI::App& app, int& exit_status);
void add_map(CLI::App& app, int& exit_status);
void add_export(CLI::App& app, int& exit_status);
void add_map_export(CLI::App& map, int& exit_status);
void add_map_merge(CLI::App& map, int& exit_status);
void add_map_transfer(CLI::App& map, int& exit_status);
void add_serve(CLI::App& app, int& exit_status);
void add_fleet(CLI::App& app, int& exit_status);
void add_settings(CLI::App& app, int& exit_status);

// Prints "bslam: MESSAGE" as one line on stderr and returns kExitBadInput.
int report_error(const Error& error);

// Checks that the file of --out does not exist, unless it may be overwritten.
Status check_new_file(const std::string& file, bool overwrite);

}  // namespace bslam::cli
