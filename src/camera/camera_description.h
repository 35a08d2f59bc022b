// A camera as some calibration file describes it, before it is checked. Every reader of a rig format ends here, so that
// the checks and their words are the same for all of them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"

namespace bslam::camera {

struct CameraDescription {
  std::string name;
  std::string model;                     // a name of model_table()
  std::vector<std::int64_t> resolution;  // width, height in pixels
  std::vector<double> intrinsics;        // fx fy cx cy
  std::vector<double> distortion;  // coefficients, or what shapes the model, as distortion() of the model gives them
  std::vector<double> T_body_cam;  // (4, 4) row-major, metres
  double time_offset_s = 0.0;
  std::string mask_file;
};

// Where a description comes from: what its fields are called there, for errors.
struct DescriptionKeys {
  std::string file;
  std::string model, resolution, intrinsics, distortion, T_body_cam, time_offset;
};

// Checks and converts. Errors: unknown model; resolution not within [1, 20000]; focal lengths not above 0; a wrong
// count of coefficients; parameters outside of their model's range; a lens that maps nothing; what rigid_transform
// refuses; a time offset beyond a million seconds.
Result<RigCamera> make_camera(const CameraDescription& description, const DescriptionKeys& keys);

// The rigid transform of sixteen numbers, the rows of a 4x4 matrix; `file` and `key` are for errors. Errors: another
// count; a rotation that is off by more than 1e-3 or mirrored; a last row that is not 0 0 0 1; a translation beyond a
// thousand kilometres. The rotation is replaced by the nearest true one, rounded to 4e-15, so that its own matrix
// or quaternion is read as the same bits again: a calibration written and read, in whatever format, does not drift.
Result<geometry::SE3> rigid_transform(const std::vector<double>& rows, const std::string& file, const std::string& key);

// The rows of its 4x4 matrix.
std::vector<double> rows_of(const geometry::SE3& T);

// The transform of a file that stores a quaternion (Hamilton) and a translation. Error: a norm off 1 by more than 1e-3.
Result<geometry::SE3> rigid_transform(const geometry::Quaterniond& rotation, const geometry::Vector3d& translation,
                                      const std::string& file, const std::string& key);

// Whole pixels as files write them, also with a decimal point. Error: a fraction.
Result<std::vector<std::int64_t>> whole_pixels(const std::vector<double>& sides, const std::string& file,
                                               const std::string& key);

// What a reader of some format hands on: its cameras, and remarks on how the file was understood.
struct RigReading {
  std::vector<RigCamera> cameras;
  std::vector<std::string> notes;
};

}  // namespace bslam::camera
