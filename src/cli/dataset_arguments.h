// The command-line options that select the input, shared by the commands that read a data set.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "dataset/dataset.h"

namespace bslam::cli {

struct DatasetArguments {
  std::string path, format = "auto", rig;
  std::optional<std::string> cameras;  // all cameras if absent
  std::optional<double> begin_s, end_s;
};

void add_dataset_options(CLI::App& verb, DatasetArguments& arguments);
// The same without DATA, for commands that take several.
void add_recording_options(CLI::App& verb, DatasetArguments& arguments);

// Errors: a malformed list of cameras.
Result<dataset::DatasetRequest> dataset_request(const DatasetArguments& arguments, double sync_tolerance_s);

}  // namespace bslam::cli
