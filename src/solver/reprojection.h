// The reprojection residual of motion-only, local and global bundle adjustment, its Jacobians and its robust cost
// (docs/math.md, sections 2 to 4).
#pragma once

#include <cmath>
#include <optional>
#include <variant>

#include "camera/rig.h"

namespace bslam::solver {

using camera::Rig;
using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::SE3;
using Matrix26d = Eigen::Matrix<double, 2, 6>;
using Matrix62d = Eigen::Matrix<double, 6, 2>;
using Matrix23d = Eigen::Matrix<double, 2, 3>;

// e = u - h(p) in pixels of the raw image, p in the camera frame. Every other Jacobian follows from `J` by the chain
// rule.
struct Residual {
  Vector2d error;  // px
  Matrix23d J;     // dh / dp, px per metre
};

// The residual for a known camera model. Returns nullopt if the model does not project the point.
template <class Model>
std::optional<Residual> residual(const Model& model, const Vector3d& point_cam, const Vector2d& pixel) {
  const auto projection = model.project_with_jacobian(point_cam);
  if (!projection) return std::nullopt;
  return Residual{pixel - projection->pixel, projection->jacobian};
}
// The value of the residual only.
template <class Model>
std::optional<Vector2d> residual_error(const Model& model, const Vector3d& point_cam, const Vector2d& pixel) {
  const auto projected = model.project(point_cam);
  if (!projected) return std::nullopt;
  return Vector2d(pixel - *projected);
}
inline std::optional<Residual> residual(const camera::CameraModel& model, const Vector3d& point_cam,
                                        const Vector2d& pixel) {
  return std::visit([&](const auto& m) { return residual(m, point_cam, pixel); }, model);
}
inline std::optional<Vector2d> residual_error(const camera::CameraModel& model, const Vector3d& point_cam,
                                              const Vector2d& pixel) {
  return std::visit([&](const auto& m) { return residual_error(m, point_cam, pixel); }, model);
}
// The same for a camera that moves during the exposure; `point_cam` are the coordinates at the capture time.
inline std::optional<Vector2d> residual_error(const camera::CameraModel& model, const camera::Shutter& shutter,
                                              const Vector3d& point_cam, const Vector2d& pixel) {
  return residual_error(model, shutter.at_row(point_cam, pixel.y()), pixel);
}

// Chain rule for a pose: J [-[p]x  I], transposed, where p = T q and J is the Jacobian with respect to p. It belongs to
// the left perturbation of T, rotation first.
inline Matrix62d pose_jacobian_transposed(const Matrix23d& J, const Vector3d& p) {
  Matrix62d out;
  for (int k = 0; k < 2; ++k) {
    const double x = J(k, 0), y = J(k, 1), z = J(k, 2);
    out.col(k) << p.y() * z - p.z() * y, p.z() * x - p.x() * z, p.x() * y - p.y() * x, x, y, z;
  }
  return out;
}

// The residual of camera i of a rig: e = u - h_i(T_i0 (R_0w P + t_0w)).
struct ReprojectionResidual {
  Vector2d error;     // px
  Matrix26d J_pose;   // de / d(left perturbation of T_rig_world, rotation first) = -J_h R_i0 [-[P']x  I]
  Matrix23d J_point;  // de / dP = -J_h R_i0 R_0w

  // Returns nullopt if camera i does not project the point.
  static std::optional<ReprojectionResidual> evaluate(const Rig& rig, CameraIndex i, const SE3& T_rig_world,
                                                      const Vector3d& point_world, const Vector2d& pixel);
  static std::optional<Vector2d> error_only(const Rig& rig, CameraIndex i, const SE3& T_rig_world,
                                            const Vector3d& point_world, const Vector2d& pixel);
};

// If observations with two degrees of freedom are truncated at their 95 % bound c, a fraction 0.95 of them remains.
// The sum of their squares (and its derivative) is 1 - exp(-c/2) (1 + c/2) = 0.80 of that of all, so that their
// variance is 0.80 / 0.95 of that of all. Covariances from the normal equations of the remaining observations are too
// small by the same factor (docs/math.md, section 4).
constexpr double kFractionLeft = 0.95, kVarianceLeft = 0.80;

// Bound of chi-square with two degrees of freedom at 95 %.
constexpr double kChi2TwoDof95 = 5.991;

// Squared normalised error at which the cost of an observation is truncated. Observations with a larger error, and
// those that do not project, have the cost of this bound and no gradient, so that a step cannot decrease the cost by
// moving a point behind a camera.
constexpr double kMaxChi2 = 1e6;

enum class Kernel { kNone, kHuber };

// Huber weight and cost of a squared normalised error; the default threshold is the 95 % bound of two degrees of
// freedom. The cost has the scale of chi2; the objective contains half of it.
inline double huber_weight(double chi2, double knee_chi2 = kChi2TwoDof95) {
  return chi2 <= knee_chi2 ? 1.0 : std::sqrt(knee_chi2 / chi2);
}
inline double huber_cost(double chi2, double knee_chi2 = kChi2TwoDof95) {
  return chi2 <= knee_chi2 ? chi2 : 2.0 * std::sqrt(knee_chi2 * chi2) - knee_chi2;
}

// The same for a given kernel; the cost is truncated.
inline double kernel_weight(Kernel kernel, double chi2) { return kernel == Kernel::kNone ? 1.0 : huber_weight(chi2); }
inline double kernel_cost(Kernel kernel, double chi2) {
  const double truncated = chi2 < kMaxChi2 ? chi2 : kMaxChi2;
  return kernel == Kernel::kNone ? truncated : huber_cost(truncated);
}

}  // namespace bslam::solver
