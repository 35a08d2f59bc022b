#include "camera/rolling_shutter.h"

#include <algorithm>

namespace bslam::camera {

Shutter::Shutter(const Camera& camera, const geometry::SE3& T_cam_rig, const geometry::Vector6d& twist) {
  if (camera.readout_s != 0) *this = Shutter(camera, {0, camera.readout_s}, T_cam_rig, twist);
}

Shutter::Shutter(const Camera& camera, const CameraTiming& timing, const geometry::SE3& T_cam_rig,
                 const geometry::Vector6d& twist) {
  if (twist.isZero(0)) return;
  const geometry::Vector6d in_camera = T_cam_rig.adjoint() * twist;
  angular = in_camera.head<3>();
  linear = in_camera.tail<3>();
  const double last_row_px = std::max(1, camera.height - 1);
  shift_s = timing.shift_s;
  seconds_per_px = timing.readout_s / last_row_px;
  middle_row_px = 0.5 * last_row_px;
}

geometry::SE3 Shutter::pose_at_row(const geometry::SE3& T_cam_common, double pixel_y) const {
  if (!rolling()) return T_cam_common;
  geometry::Vector6d twist;
  twist << angular, linear;
  return geometry::SE3::exp(delay_s(pixel_y) * twist) * T_cam_common;
}

std::optional<Vector2d> project(const Camera& camera, const Shutter& shutter, const Vector3d& point_cam) {
  // The row depends on the pixel and the pixel on the row. A step reduces the error by the ratio of the image motion
  // during the readout to the height of the image.
  constexpr int kSteps = 3;
  auto pixel = camera.project(point_cam);
  for (int step = 0; shutter.rolling() && pixel && step < kSteps; ++step)
    pixel = camera.project(shutter.at_row(point_cam, pixel->y()));
  return pixel;
}

}  // namespace bslam::camera
