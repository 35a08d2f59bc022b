// Common parts of the two forms of `bslam bench`: the table of many sequences, and the times of one.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "cli/child_process.h"
#include "cli/config_arguments.h"
#include "cli/dataset_arguments.h"
#include "report/document.h"

namespace bslam::cli {

constexpr std::size_t kMaxLogBytes = std::size_t{1} << 26;

struct BenchArguments {
  DatasetArguments data;  // `path` is the folder of the sequences; with `time`, one recording
  ConfigArguments config;
  std::string out = "bench", mode, pace, late, vocabulary, against;
  int runs = 5;
  double margin_percent = 10.0;
  bool no_loop = false, no_final_ba = false, overwrite = false, time = false;
};

// Returns the options that every run receives as they are.
std::vector<std::string> run_options(const BenchArguments& arguments);

// Returns the arguments of `bslam run` for a recording, whose calibration is `rig` or its own if that is empty.
std::vector<std::string> run_words(const BenchArguments& arguments, const std::string& data, const std::string& rig,
                                   const std::filesystem::path& folder, int seed);

// Name of the processor as the kernel reports it; empty if it does not.
std::string processor_name();

// The reason why a run failed, which is its last message; empty if it did not fail.
std::string failure_of(const ProcessEnd& end, const std::filesystem::path& log);

// Creates the folder of --out and checks that it may be written.
Status prepare_folder(const BenchArguments& arguments);

// Writes report.md and report.html.
Status write_document(const report::Document& document, const std::filesystem::path& folder);

// bslam bench --time. Returns the exit status; errors are printed.
int bench_time(const BenchArguments& arguments);

}  // namespace bslam::cli
