// Descriptions of rigs for users.
#pragma once

#include <string>
#include <vector>

#include "camera/rig.h"

namespace bslam::calibration {

// Angles of view in radians, measured along lines through the principal point. If the border of the image is outside of
// the domain of the camera model, the angle ends at the border of the domain.
struct FieldOfView {
  double horizontal = 0, vertical = 0, diagonal = 0;
};
FieldOfView field_of_view(const camera::Camera& camera);

// "11.0 cm to the right, 2.0 cm below". `displacement` is in metres, in the frame of camera 0 (x right, y down, z
// forward).
std::string displacement_in_words(const geometry::Vector3d& displacement);

// Several lines: model, resolution, fields of view and pose of every camera; baselines; overlaps.
std::string describe_rig(const camera::Rig& rig);

}  // namespace bslam::calibration
