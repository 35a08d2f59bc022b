// Rolling shutter: the rows of an image are exposed one after the other while the camera moves (docs/math.md, section
// 13).
#pragma once

#include "camera/camera.h"
#include "geometry/se3.h"

namespace bslam::camera {

// When the rows of a camera are exposed, relative to the capture time of its image.
struct CameraTiming {
  double shift_s = 0;    // exposure of the middle row minus the capture time: the error of the capture time
  double readout_s = 0;  // see Camera::readout_s
};

// A camera that moves during the exposure of an image. By default the shutter is global, or the motion unknown: nothing
// changes between the rows.
struct Shutter {
  // Velocity of the world in the camera frame, rad/s and m/s: T_cam_world(t + dt) = exp(dt (angular, linear))
  // T_cam_world(t).
  Vector3d angular = Vector3d::Zero(), linear = Vector3d::Zero();
  double shift_s = 0, seconds_per_px = 0, middle_row_px = 0;

  Shutter() = default;
  // `twist`: velocity of the rig in its own frame, with T_rig_world(t + dt) = exp(dt twist) T_rig_world(t).
  Shutter(const Camera& camera, const geometry::SE3& T_cam_rig, const geometry::Vector6d& twist);
  Shutter(const Camera& camera, const CameraTiming& timing, const geometry::SE3& T_cam_rig,
          const geometry::Vector6d& twist);

  // Returns true if rows are exposed at times that differ from the capture time.
  bool rolling() const { return seconds_per_px != 0 || shift_s != 0; }
  // The exposure of the row at this height relative to the capture time, in seconds.
  double delay_s(double pixel_y) const { return shift_s + seconds_per_px * (pixel_y - middle_row_px); }

  // The velocity of a point in the camera frame.
  Vector3d velocity_of(const Vector3d& point_cam) const { return angular.cross(point_cam) + linear; }
  // Coordinates, when the row at this height is exposed, of a point with the coordinates `point_cam` at the capture
  // time; to second order of the motion between the two.
  Vector3d at_row(const Vector3d& point_cam, double pixel_y) const {
    if (!rolling()) return point_cam;
    const double s = delay_s(pixel_y);
    const Vector3d u = velocity_of(point_cam);
    return point_cam + s * (u + 0.5 * s * angular.cross(u));
  }
  // The derivative of at_row with respect to the point.
  geometry::Matrix3d row_jacobian(double pixel_y) const {
    const geometry::Matrix3d S = delay_s(pixel_y) * geometry::skew(angular);
    return geometry::Matrix3d::Identity() + S + 0.5 * S * S;
  }
  // The bearing, at the capture time, of a distant point that appears at height `pixel_y` in the
  // direction `bearing`.
  Vector3d bearing_at_middle(const Vector3d& bearing, double pixel_y) const {
    return rolling() ? geometry::so3_exp(-delay_s(pixel_y) * angular) * bearing : bearing;
  }
  // The camera's pose when the row at this height is exposed, from the pose at the capture time.
  geometry::SE3 pose_at_row(const geometry::SE3& T_cam_common, double pixel_y) const;
};

// Pixel of a point with the coordinates `point_cam` at the capture time.
std::optional<Vector2d> project(const Camera& camera, const Shutter& shutter, const Vector3d& point_cam);

}  // namespace bslam::camera
