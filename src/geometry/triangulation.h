// A point from two or more rays of known origin and direction.
#pragma once

#include <optional>
#include <span>

#include "geometry/so3.h"

namespace bslam::geometry {

struct Ray {
  Vector3d origin;     // metres, in any common frame
  Vector3d direction;  // unit, same frame
};

// Point with the least sum of squared distances to the rays, in their frame. Empty where the rays are parallel to
// within `min_angle` radians for every pair with the first, or where the point lies behind one of the origins.
std::optional<Vector3d> triangulate_midpoint(std::span<const Ray> rays, double min_angle);

// Angle between two unit vectors in radians, exact also near 0 and pi.
double angle_between(const Vector3d& a, const Vector3d& b);

}  // namespace bslam::geometry
