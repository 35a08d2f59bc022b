#include "camera/camera.h"

namespace bslam::camera {

std::optional<Vector2d> Camera::project(const Vector3d& point_cam) const {
  return std::visit([&](const auto& m) { return m.project(point_cam); }, model);
}

std::optional<Projection> Camera::project_with_jacobian(const Vector3d& point_cam) const {
  return std::visit([&](const auto& m) { return m.project_with_jacobian(point_cam); }, model);
}

std::optional<Vector3d> Camera::unproject(const Vector2d& pixel) const {
  return std::visit([&](const auto& m) { return m.unproject(pixel); }, model);
}

double Camera::radians_per_pixel() const {
  const Intrinsics& k = intrinsics(model);
  return 2.0 / (k.fx + k.fy);
}

}  // namespace bslam::camera
