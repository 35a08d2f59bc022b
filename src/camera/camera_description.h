// A camera as described by a calibration file, before validation. All readers of rig formats use it, so that the checks
// and error messages are the same for every format.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"

namespace bslam::camera {

struct CameraDescription {
  std::string name;
  std::string model;                     // a model name of model_table()
  std::vector<std::int64_t> resolution;  // width, height in pixels
  std::vector<double> intrinsics;        // fx fy cx cy
  std::vector<double> distortion;        // distortion coefficients or shape parameters, in the order of distortion()
  std::vector<double> T_body_cam;        // (4, 4) row-major, metres
  double time_offset_s = 0.0;
  std::string mask_file;
  double readout_s = 0.0;  // see Camera::readout_s
};

// The file a description was read from, and the names of its keys in that file, for error messages.
struct DescriptionKeys {
  std::string file;
  std::string model, resolution, intrinsics, distortion, T_body_cam, time_offset;
  std::string readout = {};
};

// Validates a description and converts it. Errors: an unknown model; a resolution outside [1, 20000]; a focal length
// that is not positive; a wrong number of coefficients; parameters outside the range of the model; a model that
// projects nothing; an invalid T_body_cam (see rigid_transform); a time offset beyond a million seconds; a readout time
// beyond a second.
Result<RigCamera> make_camera(const CameraDescription& description, const DescriptionKeys& keys);

// Converts sixteen numbers, the rows of a 4x4 matrix, to a rigid transform. `file` and `key` are used in errors.
// Errors: a wrong number of values; a rotation that is mirrored or deviates from orthonormal by more than 1e-3; a last
// row other than 0 0 0 1; a translation beyond a thousand kilometres. The rotation is replaced by the nearest
// orthonormal one, rounded to 4e-15, so that repeatedly writing and reading a calibration, in any format, does not
// change it.
Result<geometry::SE3> rigid_transform(const std::vector<double>& rows, const std::string& file, const std::string& key);

// Returns the rows of the 4x4 matrix of T.
std::vector<double> rows_of(const geometry::SE3& T);

// Converts a Hamilton quaternion and a translation to a rigid transform. Error: the norm of the quaternion differs from
// 1 by more than 1e-3.
Result<geometry::SE3> rigid_transform(const geometry::Quaterniond& rotation, const geometry::Vector3d& translation,
                                      const std::string& file, const std::string& key);

// Converts image sizes that files may write with a decimal point to integers. Error: a fractional value.
Result<std::vector<std::int64_t>> whole_pixels(const std::vector<double>& sides, const std::string& file,
                                               const std::string& key);

// The result of reading a calibration file: its cameras, and notes on how the file was interpreted.
struct RigReading {
  std::vector<RigCamera> cameras;
  std::vector<std::string> notes;
  geometry::SE3 T_cam0_rig = {};  // see Rig
  // The topics of the images of all cameras, each of which may be empty; none if the format does not name them.
  std::vector<std::string> topics = {};
};

}  // namespace bslam::camera
