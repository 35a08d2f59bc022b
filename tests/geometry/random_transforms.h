// Seeded random transforms and points for tests.
#pragma once

#include <numbers>

#include "base/random.h"
#include "geometry/sim3.h"

namespace bslam::geometry {

inline Vector3d random_vector(Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

inline Vector3d random_direction(Random& random) {
  return Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

// Returns a rotation vector whose angle is uniform in [0, `max_angle`).
inline Vector3d random_rotation_vector(Random& random, double max_angle = 0.999 * std::numbers::pi) {
  return random.uniform(0.0, max_angle) * random_direction(random);
}

inline SE3 random_se3(Random& random, double size = 5.0) {
  return SE3(so3_exp(random_rotation_vector(random)), random_vector(random, size));
}

}  // namespace bslam::geometry
