// Are the calibrated extrinsics those of the images, and which would be? Bundle adjustment over rig poses, points and the
// extrinsics of all cameras but the first, held by a prior about what was calibrated. It knows no map.
#pragma once

#include <array>
#include <span>
#include <stop_token>
#include <vector>

#include "solver/bundle_adjuster.h"

namespace bslam::solver {

struct RigAdjusterOptions {
  double sigma_rotation = 0.035;     // radians, per axis: standard deviation of the calibrated extrinsics (2 degrees)
  double sigma_translation = 0.03;   // metres, per axis
  int iterations = 15;               // of each round at most
  double relative_decrease = 1e-6;   // of the cost, below which a round has converged
};

// One camera. Six degrees of freedom are always rotation about the camera's x, y, z (radians), then translation along them
// (metres): the left perturbation of T_cam_rig, which turns the camera about its own centre.
struct ExtrinsicEstimate {
  SE3 T_cam_rig;
  geometry::Vector6d change = geometry::Vector6d::Zero();      // from the calibrated to the estimated ones
  // Of the estimate, poses and points and the other cameras being unknown as well; with the prior.
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  // Less than half of the prior's standard deviation is left: at least three quarters of an error of the calibration in this
  // degree of freedom come out as change. The length common to all baselines never is, where it is all that tells the scale.
  std::array<bool, 6> observed = {};
  int observations = 0;  // that agree with the estimate
};

struct RigAdjustment {
  bool done = false;  // false: fewer than two cameras, nothing to learn from, stopped or failed; the problem is as it was
  std::vector<ExtrinsicEstimate> cameras;      // all; the first is the identity and known
  double final_cost = 0;                       // as in BundleSummary, over what agrees and the calibration
  double variance_factor = 1;  // mean squared normalised error over what it should be: covariances are larger by it, if > 1
};

// Improves free poses and points in place. The problem's rig is the calibrated one; the extrinsics start from `start`, one
// T_cam_rig per camera, or from the calibrated ones where it is empty. At least one pose of every part that shares points is
// fixed. Rounds: Huber kernel over every observation, then over those within a widened bound, then without kernel within the
// 95 % bound, twice; each judges all of them anew, so that what a wrong calibration had put out of bounds comes back.
// Deterministic to the bit.
RigAdjustment adjust_rig(ReprojectionProblem& problem, const RigAdjusterOptions& options = {}, std::span<const SE3> start = {},
                         std::stop_token stop = {});

}  // namespace bslam::solver
