// What a calibration format can hold, declared once a format, so that whatever does not fit is refused by name.
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"

namespace bslam::rig_formats {

enum class Holds { kNothing, kOneForAll, kEach };

struct RigLimits {
  std::string_view format;               // for errors
  std::vector<std::string_view> models;  // as named in our rig file
  Holds time_offsets = Holds::kNothing;
  bool body_frame = true;             // else the body is camera 0
  std::size_t most_coefficients = 8;  // of pinhole-radtan
  std::size_t most_cameras = std::numeric_limits<std::size_t>::max();
};

// Error for the first thing of the rig that the format cannot hold: a mask, a time offset, a model, radial-tangential
// coefficients beyond its count, a body frame other than camera 0, too many cameras. `out` is the file for the error.
Status check_limits(const camera::Rig& rig, const std::string& out, const RigLimits& limits);

// The coefficients without trailing zeros that change nothing: radial-tangential ones shortened to 5 or 4.
std::vector<double> needed_coefficients(const camera::CameraModel& model);

// "[1.0, 2.5]": each number as the shortest text that reads back as the same double.
std::string number_list(const std::vector<double>& values);

}  // namespace bslam::rig_formats
