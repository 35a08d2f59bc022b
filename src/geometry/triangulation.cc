#include "geometry/triangulation.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace bslam::geometry {

double angle_between(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

std::optional<Vector3d> triangulate_midpoint(std::span<const Ray> rays, double min_angle) {
  if (rays.size() < 2) return std::nullopt;
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  double widest = 0.0;
  for (const Ray& ray : rays) {
    const Matrix3d P = Matrix3d::Identity() - ray.direction * ray.direction.transpose();
    A += P;
    b += P * ray.origin;
    widest = std::max(widest, angle_between(rays.front().direction, ray.direction));
  }
  if (widest < min_angle) return std::nullopt;
  const Vector3d point = A.inverse() * b;
  if (!point.allFinite()) return std::nullopt;
  for (const Ray& ray : rays) {
    if (ray.direction.dot(point - ray.origin) <= 0.0) return std::nullopt;
  }
  return point;
}

}  // namespace bslam::geometry
