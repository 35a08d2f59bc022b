// Bundle adjustment over rig poses, points and the extrinsics of all cameras but the first, with the calibrated
// extrinsics as a prior: whether the images agree with the calibration, and which extrinsics they tell. Independent of
// the map.
#pragma once

#include <array>
#include <span>
#include <stop_token>
#include <vector>

#include "solver/bundle_adjuster.h"
#include "solver/rig_block.h"

namespace bslam::solver {

struct ExtrinsicAdjustmentOptions {
  double sigma_rotation = 0.035;    // radians, per axis: standard deviation of the calibrated extrinsics (2 degrees)
  double sigma_translation = 0.03;  // metres, per axis
  int iterations = 15;              // of each round at most
  double relative_decrease = 1e-6;  // of the cost, below which a round has converged
};

// One camera. The six degrees of freedom are rotation about the camera's x, y, z (radians), then translation along them
// (metres): the left perturbation of T_cam_rig, which rotates the camera about its own centre.
struct ExtrinsicEstimate {
  SE3 T_cam_rig;
  geometry::Vector6d change = geometry::Vector6d::Zero();  // from the calibrated to the estimated extrinsics
  // Of the estimate, with the prior; poses, points and the other cameras are marginalised out.
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  // The standard deviation is less than half of the prior's: at least three quarters of a calibration error in this
  // degree of freedom appear in `change`. A common factor of all baselines is not observed where nothing else tells the
  // scale.
  std::array<bool, 6> observed = {};
  int observations = 0;  // that agree with the estimate
};

struct ExtrinsicAdjustment {
  bool done = false;  // false, with the problem unchanged: fewer than two cameras, no observations, stopped or failed
  std::vector<ExtrinsicEstimate> cameras;  // all; the first is the identity and known
  double final_cost = 0;                   // as in LmSummary, over the observations that agree and the prior
  double variance_factor = 1;  // mean squared normalised error over its expectation; above 1 it scales the covariances
};

// Improves free poses and points in place. The problem's rig is the calibrated one; the extrinsics start from `start`,
// one T_cam_rig per camera, or from the calibrated ones where it is empty. At least one pose is fixed in every part
// that shares points. Rounds: with Huber kernel over every observation, then over those within a widened bound, then
// twice without kernel within the 95 % bound. Each round classifies all observations again, so those that a wrong
// calibration had put out of bounds return. Deterministic to the bit.
ExtrinsicAdjustment adjust_extrinsics(ReprojectionProblem& problem, const ExtrinsicAdjustmentOptions& options = {},
                                      std::span<const SE3> start = {}, std::stop_token stop = {});

}  // namespace bslam::solver
