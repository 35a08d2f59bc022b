// The table of camera models: a row for each alternative of CameraModel, with its name in calibration files and its
// parameters in addition to fx fy cx cy. All code that reads, writes or checks calibrations uses this table; a new
// model is a class, an alternative of CameraModel and a row here.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "camera/camera_model.h"

namespace bslam::camera {

// A parameter in addition to the focal lengths and the principal point, and its valid range.
struct ModelParameter {
  std::string_view name;
  double sigma;                  // typical standard deviation of a calibrated value, as a prior for its estimation
  double low, high;              // bounds; infinite if there is none
  bool low_is_excluded = false;  // `low` is not part of the range

  bool allows(double value) const { return value <= high && (low_is_excluded ? value > low : value >= low); }
};

struct ModelRow {
  std::string_view name;                   // name of the model in rig files
  std::vector<ModelParameter> parameters;  // in the order of rig files
  std::vector<std::size_t> counts;         // the accepted numbers of parameters in a file, ascending
  CameraModel (*make)(const Intrinsics& intrinsics,
                      const std::vector<double>& parameters);  // with an accepted number of parameters

  bool takes(std::size_t count) const;
};

// Returns the rows in the order of CameraModel's alternatives.
const std::vector<ModelRow>& model_table();

// Returns null if no model has that name.
const ModelRow* find_model(std::string_view name);

// Returns the names of all models, in the order of the table.
std::vector<std::string_view> model_names();

}  // namespace bslam::camera
