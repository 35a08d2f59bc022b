// The table of camera models: a row for each alternative of CameraModel, with its name in calibration files and the
// parameters it takes beside fx fy cx cy. Whoever reads, writes or checks calibrations asks this table; a new model is
// a class, an alternative of CameraModel and a row here.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "camera/camera_model.h"

namespace bslam::camera {

// One parameter beside the focal lengths and the principal point, and the values it may take.
struct ModelParameter {
  std::string_view name;
  double low, high;              // bounds; infinite where there is none
  bool low_is_excluded = false;  // `low` itself is not allowed

  bool allows(double value) const { return value <= high && (low_is_excluded ? value > low : value >= low); }
};

struct ModelRow {
  std::string_view name;                   // as written in rig files
  std::vector<ModelParameter> parameters;  // in the order of rig files
  std::vector<std::size_t> counts;         // how many of them a file may give, ascending
  CameraModel (*make)(const Intrinsics& intrinsics, const std::vector<double>& parameters);  // a count of `counts`

  bool takes(std::size_t count) const;
};

// In the order of CameraModel's alternatives.
const std::vector<ModelRow>& model_table();

// Null where no model has that name.
const ModelRow* find_model(std::string_view name);

// Names of all models, in the order of the table.
std::vector<std::string_view> model_names();

}  // namespace bslam::camera
