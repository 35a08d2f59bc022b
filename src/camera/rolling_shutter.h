// Rolling shutter: the rows of an image are exposed one after the other while the camera moves (docs/math.md, section
// 13).
#pragma once

#include "camera/camera.h"
#include "geometry/se3.h"

namespace bslam::camera {

// A camera that moves during the exposure of an image. By default the shutter is global, or the motion unknown: nothing
// changes between the rows.
struct Shutter {
  // Velocity of the world in the camera frame, rad/s and m/s: T_cam_world(t + dt) = exp(dt (angular, linear))
  // T_cam_world(t).
  Vector3d angular = Vector3d::Zero(), linear = Vector3d::Zero();
  double seconds_per_px = 0, middle_row_px = 0;

  Shutter() = default;
  // `twist`: velocity of the rig in its own frame, with T_rig_world(t + dt) = exp(dt twist) T_rig_world(t).
  Shutter(const Camera& camera, const geometry::SE3& T_cam_rig, const geometry::Vector6d& twist);

  bool rolling() const { return seconds_per_px != 0; }
  // Exposure of the row at this height minus the exposure of the middle row, in seconds.
  double delay_s(double pixel_y) const { return seconds_per_px * (pixel_y - middle_row_px); }

  // The velocity of a point in the camera frame.
  Vector3d velocity_of(const Vector3d& point_cam) const { return angular.cross(point_cam) + linear; }
  // Coordinates, when the row at this height is exposed, of a point with the coordinates `point_cam` when the middle
  // row is exposed; to second order of the motion between the two.
  Vector3d at_row(const Vector3d& point_cam, double pixel_y) const {
    if (!rolling()) return point_cam;
    const double s = delay_s(pixel_y);
    const Vector3d u = velocity_of(point_cam);
    return point_cam + s * (u + 0.5 * s * angular.cross(u));
  }
  // The bearing, at the exposure of the middle row, of a distant point that appears at height `pixel_y` in the
  // direction `bearing`.
  Vector3d bearing_at_middle(const Vector3d& bearing, double pixel_y) const {
    return rolling() ? geometry::so3_exp(-delay_s(pixel_y) * angular) * bearing : bearing;
  }
  // The camera's pose when the row at this height is exposed, from the pose when the middle row is exposed.
  geometry::SE3 pose_at_row(const geometry::SE3& T_cam_common, double pixel_y) const;
};

// Pixel of a point with the coordinates `point_cam` when the middle row is exposed.
std::optional<Vector2d> project(const Camera& camera, const Shutter& shutter, const Vector3d& point_cam);

}  // namespace bslam::camera
