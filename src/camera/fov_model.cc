// The field-of-view model. Equations: docs/math.md, section 8.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "base/assert.h"
#include "camera/camera_model.h"

namespace bslam::camera {
namespace {

constexpr double kOnAxis = 1e-12;  // radii below this one have the limits on the optical axis

}  // namespace

Fov::Fov(const Intrinsics& k, double w) : k_(k), w_(w), slope_(2 * std::tan(0.5 * w)) {
  BSLAM_ASSERT(w > 0 && w < std::numbers::pi, "w lies in (0, pi)");
}

double Fov::scale(double radius) const {
  return radius > kOnAxis ? std::atan(slope_ * radius) / (w_ * radius) : slope_ / w_;
}

std::optional<Vector2d> Fov::project(const Vector3d& point) const {
  if (!(point.z() > image_plane::kMinDepth)) return std::nullopt;
  const Vector2d m = point.head<2>() / point.z();
  if (!m.allFinite()) return std::nullopt;
  const Vector2d distorted = scale(m.norm()) * m;
  return image_plane::to_pixel(k_, distorted);
}

std::optional<Projection> Fov::project_with_jacobian(const Vector3d& point) const {
  const auto pixel = project(point);
  if (!pixel) return std::nullopt;
  const Vector2d m = point.head<2>() / point.z();
  const double radius = m.norm(), across = scale(radius), tangent = slope_ * radius;
  const double along = slope_ / (w_ * (1 + tangent * tangent));  // derivative of the distorted radius
  const Vector2d u = radius > kOnAxis ? Vector2d(m / radius) : Vector2d::UnitX();
  const Vector2d v(-u.y(), u.x());
  Matrix23d plane;  // z d m / d point
  plane << 1, 0, -m.x(), 0, 1, -m.y();
  Projection out{*pixel, (along * u * u.transpose() + across * v * v.transpose()) * plane / point.z()};
  out.jacobian.row(0) *= k_.fx;
  out.jacobian.row(1) *= k_.fy;
  return out;
}

void Fov::distortion_jacobian(const Vector3d& point, Eigen::Ref<Matrix2Xd> J) const {
  const Vector2d m = point.head<2>() / point.z();
  const double tangent = slope_ * m.norm(), slope_change = 1 + 0.25 * slope_ * slope_;  // d slope / d w
  J.col(0) = (slope_change / (1 + tangent * tangent) - scale(m.norm())) / w_ * m;
}

std::optional<Vector3d> Fov::unproject(const Vector2d& pixel) const {
  if (!pixel.allFinite()) return std::nullopt;
  const Vector2d m((pixel.x() - k_.cx) / k_.fx, (pixel.y() - k_.cy) / k_.fy);
  const double radius = m.norm(), angle = w_ * radius;
  if (!(angle < 0.5 * std::numbers::pi)) return std::nullopt;
  const double sine_by_radius = radius > kOnAxis ? std::sin(angle) / radius : w_;
  return Vector3d(sine_by_radius * m.x(), sine_by_radius * m.y(), slope_ * std::cos(angle)).normalized();
}

}  // namespace bslam::camera
