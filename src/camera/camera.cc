#include "camera/camera.h"

#include "base/assert.h"
#include "camera/model_parameters.h"

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
  // Computed from the Jacobian rather than from fx and fy, because some models have another focal length on the optical
  // axis.
  const auto axis = project_with_jacobian(Vector3d::UnitZ());
  BSLAM_ASSERT(axis, "the optical axis must be in the domain of the model");
  return 2.0 / (axis->jacobian(0, 0) + axis->jacobian(1, 1));
}

Camera zoomed(Camera camera, double factor) {
  ModelParameters p = parameters(camera.model);
  p.head<2>() *= factor;
  camera.model = with_parameters(camera.model, p);
  return camera;
}

}  // namespace bslam::camera
