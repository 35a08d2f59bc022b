// The command-line options that select the input, shared by the commands that read a data set.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "dataset/dataset.h"

namespace bslam::cli {

// Where the images of a recording are, and how its time stamps and pixels are to be read.
struct ImageArguments {
  std::string topics;
  bool side_by_side = false;
  std::optional<double> rate_hz;
  std::string stamp_unit, bayer, masks, vignettes;
};

struct DatasetArguments {
  std::string path, format = "auto", rig;
  std::optional<std::string> cameras;  // all cameras if absent
  std::optional<double> begin_s, end_s;
  ImageArguments images;
};

void add_image_options(CLI::App& verb, ImageArguments& arguments);

// Applies the options to a request. Errors: an unknown colour filter.
Status apply_image_options(const ImageArguments& arguments, dataset::DatasetRequest& request);

void add_dataset_options(CLI::App& verb, DatasetArguments& arguments);
// The same without DATA, for commands that take several.
void add_recording_options(CLI::App& verb, DatasetArguments& arguments);

// Errors: a malformed list of cameras, and those of apply_image_options.
Result<dataset::DatasetRequest> dataset_request(const DatasetArguments& arguments, double sync_tolerance_s);

}  // namespace bslam::cli
