// Projection by the pinhole models, defined here so that it is inlined in the loops over observations of bundle
// adjustment. Included by camera_model.h only.
#pragma once

#include <cmath>

namespace bslam::camera {
namespace image_plane {

constexpr double kMinDepth = 1e-6;  // metres; points closer to the plane of a pinhole camera are not projected

inline Vector2d to_pixel(const Intrinsics& k, const Vector2d& m) { return {k.fx * m.x() + k.cx, k.fy * m.y() + k.cy}; }

// d (x/z, y/z) / d (x, y, z)
inline Matrix23d plane_jacobian(const Vector3d& p) {
  const double iz = 1.0 / p.z();
  Matrix23d J;
  J << iz, 0, -p.x() * iz * iz, 0, iz, -p.y() * iz * iz;
  return J;
}

}  // namespace image_plane

inline std::optional<Vector2d> Pinhole::project(const Vector3d& point) const {
  if (!(point.z() > image_plane::kMinDepth)) return std::nullopt;
  const Vector2d m = point.head<2>() / point.z();
  if (!m.allFinite()) return std::nullopt;
  return image_plane::to_pixel(k_, m);
}

inline std::optional<Projection> Pinhole::project_with_jacobian(const Vector3d& point) const {
  if (!(point.z() > image_plane::kMinDepth)) return std::nullopt;
  const Vector2d m = point.head<2>() / point.z();
  if (!m.allFinite()) return std::nullopt;
  Projection out{image_plane::to_pixel(k_, m), image_plane::plane_jacobian(point)};
  out.jacobian.row(0) *= k_.fx;
  out.jacobian.row(1) *= k_.fy;
  return out;
}

inline PinholeRadTan::Radial PinholeRadTan::radial(double r2) const {
  const auto [k1, k2, p1, p2, k3, k4, k5, k6] = d_;
  const double a = 1 + r2 * (k1 + r2 * (k2 + r2 * k3)), da = k1 + r2 * (2 * k2 + r2 * 3 * k3);
  if (count_ < 8) return {a, da};
  const double b = 1 + r2 * (k4 + r2 * (k5 + r2 * k6)), db = k4 + r2 * (2 * k5 + r2 * 3 * k6);
  return {a / b, (da * b - a * db) / (b * b)};
}

inline Vector2d PinholeRadTan::distorted(const Vector2d& m, double r2, const Radial& radial) const {
  const double x = m.x(), y = m.y(), f = radial.factor, p1 = d_[2], p2 = d_[3];
  return {x * f + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * f + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

inline PinholeRadTan::Distorted PinholeRadTan::distort(const Vector2d& m) const {
  const double x = m.x(), y = m.y(), r2 = m.squaredNorm(), p1 = d_[2], p2 = d_[3];
  const Radial r = radial(r2);
  const double f = r.factor, df = r.derivative;
  Distorted out;
  out.point = distorted(m, r2, r);
  out.jacobian << f + 2 * x * x * df + 2 * p1 * y + 6 * p2 * x, 2 * x * y * df + 2 * p1 * x + 2 * p2 * y,
      2 * x * y * df + 2 * p1 * x + 2 * p2 * y, f + 2 * y * y * df + 6 * p1 * y + 2 * p2 * x;
  return out;
}

inline std::optional<Vector2d> PinholeRadTan::project(const Vector3d& point) const {
  if (!(point.z() > image_plane::kMinDepth)) return std::nullopt;
  const Vector2d m = point.head<2>() / point.z();
  const double r2 = m.squaredNorm();
  if (!(std::sqrt(r2) < max_radius_)) return std::nullopt;
  return image_plane::to_pixel(k_, distorted(m, r2, radial(r2)));
}

inline std::optional<Projection> PinholeRadTan::project_with_jacobian(const Vector3d& point) const {
  if (!(point.z() > image_plane::kMinDepth)) return std::nullopt;
  const Vector2d m = point.head<2>() / point.z();
  if (!(m.norm() < max_radius_)) return std::nullopt;
  const Distorted d = distort(m);
  Projection out{image_plane::to_pixel(k_, d.point), d.jacobian * image_plane::plane_jacobian(point)};
  out.jacobian.row(0) *= k_.fx;
  out.jacobian.row(1) *= k_.fy;
  return out;
}

}  // namespace bslam::camera
