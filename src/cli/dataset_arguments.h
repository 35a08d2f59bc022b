// The options that say which data to read, shared by the verbs that read a data set.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "dataset/dataset.h"

namespace bslam::cli {

struct DatasetArguments {
  std::string path, format = "auto", rig;
  std::optional<std::string> cameras;  // absent: all
  std::optional<double> begin_s, end_s;
};

void add_dataset_options(CLI::App& verb, DatasetArguments& arguments);

// Errors: a list of cameras that is none.
Result<dataset::DatasetRequest> dataset_request(const DatasetArguments& arguments, double sync_tolerance_s);

}  // namespace bslam::cli
