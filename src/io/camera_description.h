// A camera as some calibration file describes it, before it is checked. Every reader of a rig format ends here, so that
// the checks and their words are the same for all of them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"

namespace bslam::io {

struct CameraDescription {
  std::string name;
  std::string model;                     // as in our rig file: pinhole, pinhole-radtan, kannala-brandt
  std::vector<std::int64_t> resolution;  // width, height in pixels
  std::vector<double> intrinsics;        // fx fy cx cy
  std::vector<double> distortion;
  std::vector<double> T_body_cam;  // (4, 4) row-major, metres
  double time_offset_s = 0.0;
  std::string mask_file;
};

// Where a description comes from: what its fields are called there, for errors.
struct DescriptionKeys {
  std::string file;
  std::string model, resolution, intrinsics, distortion, T_body_cam, time_offset;
};

// The models a rig may have, as named in our rig file.
const std::vector<std::string>& known_models();

// Checks and converts. Errors: unknown model; resolution not within [1, 20000]; focal lengths not above 0; a wrong
// count of coefficients; a lens that maps nothing; a transform whose rotation is off by more than 1e-3 or mirrored, or
// whose last row is not 0 0 0 1; a time offset beyond a million seconds. The rotation is replaced by the nearest true
// one.
Result<camera::RigCamera> make_camera(const CameraDescription& description, const DescriptionKeys& keys);

}  // namespace bslam::io
