// The one reprojection residual of motion-only, local and global bundle adjustment (docs/math.md, sections 2 to 4).
#pragma once

#include <optional>

#include "camera/rig.h"

namespace bslam::solver {

using camera::Rig;
using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::SE3;
using Matrix26d = Eigen::Matrix<double, 2, 6>;
using Matrix23d = Eigen::Matrix<double, 2, 3>;

// e = u - h_i(T_i0 (R_0w P + t_0w)): pixels of the raw image of camera i.
struct ReprojectionResidual {
  Vector2d error;     // px
  Matrix26d J_pose;   // de / d(left perturbation of T_rig_world, rotation first) = -J_h R_i0 [-[P']x  I]
  Matrix23d J_point;  // de / dP = -J_h R_i0 R_0w

  // Empty where camera i does not project the point.
  static std::optional<ReprojectionResidual> evaluate(const Rig& rig, CameraIndex i, const SE3& T_rig_world,
                                                      const Vector3d& point_world, const Vector2d& pixel);
  static std::optional<Vector2d> error_only(const Rig& rig, CameraIndex i, const SE3& T_rig_world,
                                            const Vector3d& point_world, const Vector2d& pixel);
};

// chi-square bounds at 95 %.
constexpr double kChi2OneDof95 = 3.841, kChi2TwoDof95 = 5.991;

// Squared normalised error from which on an observation is lost: it costs as much as at this bound, whether it misses
// by more or does not project at all, and pulls nowhere. So a step never gains by pushing a point behind a camera.
constexpr double kLostChi2 = 1e6;

enum class Kernel { kNone, kHuber };

// Huber weight of a squared normalised error, with its knee at the 95 % bound of two degrees of freedom; and its cost,
// on the scale of chi2 (twice what enters the sum to be minimised).
double huber_weight(double chi2, double knee_chi2 = kChi2TwoDof95);
double huber_cost(double chi2, double knee_chi2 = kChi2TwoDof95);

// The same under either kernel.
inline double kernel_weight(Kernel kernel, double chi2) {
  return kernel == Kernel::kNone || chi2 <= kChi2TwoDof95 ? 1.0 : huber_weight(chi2);
}
inline double kernel_cost(Kernel kernel, double chi2) {
  return kernel == Kernel::kNone || chi2 <= kChi2TwoDof95 ? chi2 : huber_cost(chi2);
}

}  // namespace bslam::solver
