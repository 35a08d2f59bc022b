// Rigid transforms, velocities and covariances as plain numbers. T_a_b maps coordinates in b to coordinates in a:
// p_a = T_a_b * p_b, and T_a_c = T_a_b * T_b_c. Angles are radians. Lengths are metres, but those of a map are in its
// own unit if its Scale is not metric.
#pragma once

#include <array>
#include <string_view>

#include "bslam/export.h"
#include "bslam/result.h"

namespace bslam {

enum class Scale {
  kMetric,     // lengths are metres
  kUpToScale,  // the cameras do not determine the scale, for example one camera: the unit of length is arbitrary
  // The rig can determine the scale, but its motion has not allowed it so far, or the scale that it gave has turned out
  // to be wrong.
  kUnobservable
};
BSLAM_EXPORT std::string_view to_string(Scale scale);  // "metric", "up-to-scale", "unobservable"

// Row-major 4x4, the last row 0 0 0 1.
using Matrix4 = std::array<double, 16>;
// Row-major 6x6, rotation first: rad^2, then rad m off the diagonal blocks, then m^2.
using Covariance6 = std::array<double, 36>;

struct BSLAM_EXPORT Pose {
  std::array<double, 4> rotation = {0, 0, 0, 1};  // unit quaternion x, y, z, w (Hamilton): orientation of b in a
  std::array<double, 3> translation = {0, 0, 0};  // origin of b in a; metres, or map units if the scale is not metric

  Matrix4 matrix() const;
  Pose inverse() const;  // T_b_a
  // Errors: a rotation that is mirrored or deviates from orthonormal by more than 1e-3, a last row that is not 0 0 0 1,
  // a translation beyond 1000 km, numbers that are not finite.
  static Result<Pose> from_matrix(const Matrix4& rows);
};

BSLAM_EXPORT Pose operator*(const Pose& T_a_b, const Pose& T_b_c);
BSLAM_EXPORT std::array<double, 3> operator*(const Pose& T_a_b, const std::array<double, 3>& point_b);

// Velocity of a frame relative to the world, in the axes of that frame (as the twist of nav_msgs/Odometry in
// child_frame_id).
struct Velocity {
  std::array<double, 3> angular = {0, 0, 0};  // rad/s
  std::array<double, 3> linear = {0, 0, 0};   // m/s, velocity of the frame's origin
};

}  // namespace bslam
