// Motion-only bundle adjustment with unknown capture times: the pose of a rig, and for each camera the shift of the
// time at which its image was captured (docs/math.md, section 13).
#pragma once

#include <span>
#include <vector>

#include "solver/pose_solver.h"

namespace bslam::solver {

// Normal distributions of the shifts of all cameras: means in seconds, inverse variances in 1/s^2. At first all shifts
// are zero.
struct ShiftPrior {
  Eigen::VectorXd mean_s, information;

  explicit ShiftPrior(std::size_t cameras)
      : mean_s(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(cameras))),
        information(Eigen::VectorXd::Constant(static_cast<Eigen::Index>(cameras), kExact)) {}
  // The shift of a camera has this variance about zero, and `corrected_s` of it is part of the capture times already.
  void set(std::size_t camera, double variance_s2, double corrected_s = 0) {
    mean_s(static_cast<Eigen::Index>(camera)) = -corrected_s;
    information(static_cast<Eigen::Index>(camera)) = 1 / variance_s2;
  }

  static constexpr double kExact = 1e14;      // a deviation of 0.1 microseconds
  static constexpr double kUnknown_s2 = 1.0;  // variance of a shift of which nothing is known
};

// The left perturbation of T_rig_world, and the shifts with their variances.
struct ShiftStep {
  geometry::Vector6d pose;
  Eigen::VectorXd shift_s, variance_s2;  // per camera

  bool all_finite() const { return pose.allFinite() && shift_s.allFinite() && variance_s2.allFinite(); }
};

// One Gauss-Newton step with Huber kernel from the pose `T_rig_world` and the capture times of `rig` (Rig::moving), the
// velocity of which is `twist`. `observations`: camera by camera. If the pose is constant, its step is zero.
ShiftStep time_shift_step(const Rig& rig, std::span<const PoseObservation> observations, const SE3& T_rig_world,
                          const geometry::Vector6d& twist, const ShiftPrior& prior, bool pose_free = true);

}  // namespace bslam::solver
