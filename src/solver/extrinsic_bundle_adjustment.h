// Bundle adjustment of rig poses, points and the extrinsics of all cameras but the first, with the calibrated
// extrinsics as a prior. Determines whether the images agree with the calibration. Independent of the map.
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
  int iterations = 15;              // maximum number of steps per round
  double relative_decrease = 1e-6;  // a round has converged if a step decreases the cost by a smaller fraction
};

// One camera. The six degrees of freedom are rotation around the camera's x, y, z (radians), then translation along
// them (metres): the left perturbation of T_cam_rig, which rotates the camera around its own centre.
struct ExtrinsicEstimate {
  SE3 T_cam_rig;
  geometry::Vector6d change = geometry::Vector6d::Zero();  // from the calibrated to the estimated extrinsics
  // Covariance of the estimate, including the prior; poses, points and the other cameras are marginalised out.
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  // The standard deviation is less than half of the prior's, so that at least three quarters of a calibration error in
  // this degree of freedom appear in `change`. A common scale of all baselines is not observed unless the scale is
  // determined otherwise.
  std::array<bool, 6> observed = {};
  int observations = 0;  // number of observations that agree with the estimate
};

struct ExtrinsicAdjustment {
  bool done = false;  // false if there are fewer than two cameras or no observations, or it was stopped or failed
  std::vector<ExtrinsicEstimate> cameras;  // all cameras; the first one is the identity, with zero covariance
  double final_cost = 0;                   // as in LmSummary, of the observations that agree and the prior
  double variance_factor = 1;  // mean squared normalised error over its expectation; if > 1 it scales the covariances
};

// Optimises free poses and points in place; the problem is unchanged if the result is not `done`. The problem's rig
// must be the calibrated one. `start`: initial extrinsics, one T_cam_rig per camera; empty: the calibrated ones. At
// least one pose must be fixed in every component that is connected by points. Rounds: with Huber kernel over all
// observations, then over those within a widened bound, then twice without kernel within the 95 % bound. Each round
// classifies all observations again, so that observations rejected because of a wrong calibration are used again.
// Bitwise deterministic.
ExtrinsicAdjustment adjust_extrinsics(ReprojectionProblem& problem, const ExtrinsicAdjustmentOptions& options = {},
                                      std::span<const SE3> start = {}, std::stop_token stop = {});

}  // namespace bslam::solver
