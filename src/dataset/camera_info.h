// The calibration in ROS CameraInfo and Foxglove CameraCalibration messages.
#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "camera/rig.h"
#include "containers/messages.h"
#include "geometry/se3.h"

namespace bslam::dataset {

// Returns the camera of a message, with the identity as its pose in the body. `name` is the camera's name, `source` the
// topic for errors. Errors: the camera is not calibrated (K is zero); an unknown distortion model or more coefficients
// than it has; the images are binned or a part of the sensor; values that no camera has.
Result<camera::RigCamera> camera_of(const containers::CameraInfo& info, const std::string& name,
                                    const std::string& source);

// Returns the pose of the second camera of a stereo pair in the frame of the first, from the rectification R and P of
// both. Returns nullopt unless exactly one of them has a baseline in P, and both rotations are orthonormal.
std::optional<geometry::SE3> stereo_extrinsics(const containers::CameraInfo& first,
                                               const containers::CameraInfo& second);

}  // namespace bslam::dataset
