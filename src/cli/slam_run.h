// What `bslam run` and `bslam live` have in common: options, settings, output files and messages.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/output_file.h"
#include "cli/config_arguments.h"
#include "cli/run_log.h"
#include "cli/view_arguments.h"
#include "dataset/dataset.h"
#include "geometry/up_axis.h"
#include "session/run_session.h"

namespace bslam::cli {

struct SlamArguments {
  ConfigArguments config;
  ViewArguments view;
  std::string rig;  // file of the calibration; empty: that of the data
  std::string out, mode, journal, vocabulary, save_map, load_map, rerun;
  std::optional<geometry::UpAxis> up;
  std::string progress = "auto", log_level = "warning";
  std::optional<int> seed;
  bool no_loop = false, localize_only = false, no_final_ba = false, no_report = false, overwrite = false,
       image_stamps = false, memory_report = false, count_allocations = false;
  std::string command;  // the command line, as shown in the report
};

// Adds all options but that of the calibration.
void add_slam_options(CLI::App& verb, SlamArguments& arguments);

// Returns the command line without the path of the program.
std::string command_of(std::span<const char* const> command_line);

// Applies the command-line options that override --config and --set. Errors: those of resolve_config; an unknown mode;
// settings that contradict each other.
Result<system::Config> resolve_run_config(const SlamArguments& arguments);

// Checks before the run, without leaving anything, whether all its output can be written: folder, map, journal, and the
// file or viewer of --rerun. They must be different files, also from the `further` ones.
Status check_outputs(const SlamArguments& arguments, std::vector<OutputFile> further = {});

// The input of a run besides its command-line arguments.
struct RunInput {
  system::Config config;
  const dataset::Dataset& dataset;  // without frames if there is a source
  session::SessionOptions options;  // all but settings, vocabulary, map, observer and control
  std::string check_command;        // tests the calibration against the images
  // Called when everything else is checked, before the first frame. Its error ends the run.
  std::function<Status()> before = {};
  // Called after the last frame was processed, before messages about the run. Prints warnings about the source of the
  // frames, and returns them for the record.
  std::function<std::vector<std::string>()> after = {};
};

// Loads vocabulary and map, prepares the output folder, runs, and writes the output, which check_outputs() has checked.
// Results of an earlier run in the folder are replaced by those of this run, and stay if it has none. Returns the exit
// status; errors are printed.
int run_and_write(const SlamArguments& arguments, RunInput input, session::RunControl& control);

}  // namespace bslam::cli
