// Declares for every calibration format what it can store, so that anything else is an error that names the reason.
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"

namespace bslam::rig_formats {

enum class Supports { kNothing, kOneForAll, kEach };

struct RigLimits {
  std::string_view format;               // name of the format in errors
  std::vector<std::string_view> models;  // names as in the rig file of bslam
  Supports time_offsets = Supports::kNothing;
  bool rolling_shutters = false;
  bool body_frame = true;            // the body frame may differ from camera 0
  std::size_t max_coefficients = 8;  // maximum number of coefficients of pinhole-radtan
  std::size_t max_cameras = std::numeric_limits<std::size_t>::max();
};

// Returns an Error for the first part of the rig that the format cannot store: a mask, a time offset, a rolling
// shutter, a model, too many radial-tangential coefficients, a body frame other than camera 0, too many cameras. `out`
// is the file named in the error.
Status check_limits(const camera::Rig& rig, const std::string& out, const RigLimits& limits);

// Returns the distortion coefficients without trailing zeros: eight radial-tangential coefficients may become 5 or 4.
std::vector<double> needed_coefficients(const camera::CameraModel& model);

// Returns a list such as "[1.0, 2.5]", with the shortest text for each number that is read back as the same double.
std::string number_list(const std::vector<double>& values);

}  // namespace bslam::rig_formats
