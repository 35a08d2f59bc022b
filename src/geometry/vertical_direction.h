// The vertical direction of a trajectory, estimated from the orientations of the camera.
#pragma once

#include <span>

#include "geometry/se3.h"

namespace bslam::geometry {

// Returns the upward direction in the world frame, assuming that the rig stays upright. This is the mean direction of
// the upward axis (-y) of the rig frame (= camera 0), or of another direction fixed to the rig if that one is clearly
// more constant over the poses. A unit vector; (0, -1, 0) if there are no poses.
Vector3d vertical_direction(std::span<const SE3> T_world_rig);

// T_upright_world: a rotation into axes whose z points upward along vertical_direction() and whose x is the horizontal
// part of the z axis of the rig in the first pose (of its x axis if z is within 12 degrees of the vertical). For a
// first camera that is level: x forward, y left, z up (ROS REP 103). The origin is kept.
SE3 upright_axes(std::span<const SE3> T_world_rig);
// The same with a given upward direction, a unit vector in the world.
SE3 upright_axes(std::span<const SE3> T_world_rig, const Vector3d& up);

}  // namespace bslam::geometry
