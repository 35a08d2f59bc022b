// Triangulation of a point from two or more rays.
#pragma once

#include <optional>
#include <span>

#include "geometry/so3.h"

namespace bslam::geometry {

struct Ray {
  Vector3d origin;     // metres, in any common frame
  Vector3d direction;  // unit vector, same frame
};

// Returns the point with the smallest sum of squared distances to the rays, in their common frame. Returns nullopt if
// the angle between the first ray and every other one is below `min_angle` (radians), or if the point lies behind the
// origin of a ray.
std::optional<Vector3d> triangulate_midpoint(std::span<const Ray> rays, double min_angle);

// Returns the angle between two unit vectors in radians, accurate near 0 and pi as well.
double angle_between(const Vector3d& a, const Vector3d& b);

}  // namespace bslam::geometry
