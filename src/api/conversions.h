// Conversions between the types of the public headers and the internal types.
#pragma once

#include <bslam/map_view.h>
#include <bslam/pose.h>
#include <bslam/trajectory.h>

#include <optional>

#include "evaluation/trajectory.h"
#include "geometry/se3.h"
#include "map/bundled_map.h"

namespace bslam::api {

Pose to_pose(const geometry::SE3& T);
geometry::SE3 to_se3(const Pose& pose);

// Copies the matrix: the covariance of a left perturbation of T_rig_world, rotation first, is that of a right
// perturbation of T_world_rig.
Covariance6 to_covariance(const geometry::Matrix6d& covariance);

// Returns the velocity of a frame fixed to the rig, in the axes of that frame, if the rig moves with `twist`:
// T_rig_world(t + dt) = exp(dt twist) T_rig_world(t).
Velocity to_velocity(const geometry::Vector6d& twist, const geometry::SE3& T_frame_rig);

Scale to_scale(map::Scale scale);

// Returns the poses of camera 0, bitwise unchanged, or of another frame fixed to the rig if T_rig_frame is given.
Trajectory to_trajectory(const evaluation::Trajectory& cam0, const std::optional<geometry::SE3>& T_rig_frame);

}  // namespace bslam::api
