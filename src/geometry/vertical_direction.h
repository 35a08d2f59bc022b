// The vertical direction of a trajectory, estimated from the orientations of the camera.
#pragma once

#include <span>

#include "geometry/se3.h"

namespace bslam::geometry {

// The direction in the world that is vertical, if the rig stands or moves upright: the upward direction of camera 0's
// images, unless another direction of the camera is clearly more constant over the poses. A unit vector.
Vector3d vertical_direction(std::span<const SE3> T_world_rig);

// T_upright_world: a rotation into axes whose z points upward along vertical_direction and whose x is the horizontal
// viewing direction of camera 0 in the first pose, or its right if it looks along the vertical. The identity of the
// first image's axes (x right, y down, z forward) becomes x forward, y left, z up, as in ROS. The origin is kept.
SE3 upright_axes(std::span<const SE3> T_world_rig);
// The same with a given upward direction, a unit vector in the world.
SE3 upright_axes(std::span<const SE3> T_world_rig, const Vector3d& up);

}  // namespace bslam::geometry
