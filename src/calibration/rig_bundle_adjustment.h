// Bundle adjustment of rig poses, points and the calibration of the rig: the extrinsics of all cameras but the first
// and, optionally, the intrinsics of all cameras, with the given calibration as a prior. Determines whether the images
// agree with the calibration. Independent of the map.
#pragma once

#include <array>
#include <optional>
#include <stop_token>
#include <vector>

#include "solver/bundle_adjuster.h"
#include "solver/rig_block.h"

namespace bslam::calibration {

struct RigAdjustmentOptions {
  double sigma_rotation = 0.035;    // radians, per axis: standard deviation of the calibrated extrinsics (2 degrees)
  double sigma_translation = 0.03;  // metres, per axis
  double sigma_depth = 0;           // metres, additionally along the optical axes (ExtrinsicPrior)
  // Relative standard deviation of the common scale of all baselines. If it is positive, all lengths are rescaled after
  // each round so that the common scale of the baselines stays as calibrated: the images do not determine it, and
  // iterations along a direction without information do not converge.
  double sigma_scale = 0;
  // Per camera: standard deviations of the calibrated intrinsics (camera/model_parameters.h). Empty: the intrinsics are
  // constant.
  std::vector<camera::ModelParameters> sigma_intrinsics = {};
  double sigma_aspect = 0;  // relative standard deviation of fx / fy; 0: follows from sigma_intrinsics
  // Per camera; needs solver::ReprojectionProblem::twist. Empty: the timing is constant.
  std::vector<solver::TimingPrior> timing = {};
  // Per camera: the camera whose intrinsics and timing it has (solver::SharedUnknowns).
  solver::SharedUnknowns shared = {};
  // Number of observations that carry as much information as one independent observation. Errors of a landmark in
  // successive images are similar, so that the normal equations overestimate the information of the images.
  double correlated_observations = 1;
  bool pose_effects = true;         // compute RigAdjustment::pose_effects
  bool start_is_estimate = false;   // the start is near the result: the rounds with Huber kernel are omitted
  int iterations = 15;              // maximum number of steps per round
  double relative_decrease = 1e-6;  // a round has converged if a step decreases the cost by a smaller fraction
};

// Maximum standard deviation of a value that the images determine, relative to that of the prior.
inline constexpr double kObservedRatio = 0.5;

// One camera. The six degrees of freedom of the extrinsics are rotation around the camera's x, y, z (radians), then
// translation along them (metres): the left perturbation of T_cam_rig, which rotates the camera around its own centre.
struct CameraEstimate {
  geometry::Vector6d change = geometry::Vector6d::Zero();  // from the calibrated to the estimated extrinsics
  // Covariance of the extrinsics, including the prior; all other unknowns are marginalised out.
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  // The standard deviation is less than half of the prior's, so that at least three quarters of a calibration error in
  // this degree of freedom appear in `change`. A common scale of all baselines is not observed unless the scale is
  // determined otherwise.
  std::array<bool, 6> observed = {};
  // Length in metres of the part of the translation of `change` in directions that are not observed in this sense. They
  // need not be those of axes of the camera.
  double unobserved_shift = 0;
  // Change, standard deviation and observability of the intrinsics; empty if they are constant, or those of another
  // camera (RigAdjustmentOptions::shared).
  camera::ModelParameters intrinsics_change, intrinsics_sigma;
  std::vector<bool> intrinsics_observed;
  // Differences to the prior's timing, and standard deviations, in seconds; 0 if constant.
  camera::CameraTiming timing_change, timing_sigma;
  int observations = 0;  // number of inliers
};

// The estimate as a normal distribution of the change from the calibration, and the prior, whose mean is zero. The
// unknowns are those of the extrinsics of cameras 1 to N-1 (radians, metres), then the intrinsics of all cameras, if
// they are estimated.
struct RigInformation {
  Eigen::VectorXd change;
  Eigen::MatrixXd information, prior;  // inverses of the covariances with and without the images
};

struct RigAdjustment {
  bool done = false;                    // false if there is nothing to estimate, or it was stopped or failed
  solver::RigValues values;             // the estimate
  std::vector<CameraEstimate> cameras;  // all cameras; the extrinsics of the first one are exact
  RigInformation information;
  // Per pose of the problem: its perturbation by the error of the estimate; zero if the pose is fixed. Empty if the
  // options exclude it.
  std::vector<geometry::PoseUncertainty::Effect> pose_effects;
  double final_cost = 0;       // cost as in LmSummary, of the inliers and the prior
  double variance_factor = 1;  // mean squared normalised error over its expectation; if > 1 it scales the covariances
  double scale_change = 1;     // factor by which all lengths of the problem were multiplied (see sigma_scale)
  // Relative increase of the mean squared error of the observations if the calibration were constant, less the increase
  // that is expected of a right one, because its estimate fits noise; at least 0.
  double excess_error = 0;
};

// RigInformation::prior of these options, which must have no timing.
Eigen::MatrixXd prior_information(const solver::RigValues& calibrated, const RigAdjustmentOptions& options);

// Optimises free poses and points in place; fixed poses and motions change by the scale only. The problem is unchanged
// if the result is not `done`. The problem's rig must be the calibrated one. `start`: initial values of the rig;
// nullopt: the calibrated ones. At least one pose must be fixed in every component that is connected by points. Rounds:
// with Huber kernel over all observations, then over those within a widened bound, then twice without kernel within the
// 95 % bound. Each round classifies all observations again, so that observations rejected because of a wrong
// calibration are used again. Bitwise deterministic.
RigAdjustment adjust_rig(solver::ReprojectionProblem& problem, const RigAdjustmentOptions& options = {},
                         std::optional<solver::RigValues> start = {}, std::stop_token stop = {});

}  // namespace bslam::calibration
