// Bundle adjustment of rig poses and points by Levenberg-Marquardt and the Schur complement, for local and global
// bundle adjustment. Independent of the map.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "base/options.h"
#include "geometry/pose_uncertainty.h"
#include "solver/lm.h"
#include "solver/reprojection.h"
#include "solver/rig_block.h"

namespace bslam::solver {

// Observations refer to poses and points by index. Poses are poses of the rig, so that N cameras add no unknowns.
struct ReprojectionProblem {
  struct Observation {
    int pose = 0, point = 0;
    CameraIndex camera;
    Eigen::Vector2f pixel;  // raw image
    float sigma = 1.0f;     // px, per axis
  };
  const Rig* rig = nullptr;
  std::vector<SE3> T_rig_world;
  // (poses, cameras) row-major: the motion of the rig from the time of a pose to the capture time of a camera's image,
  // T_cam_world = T_cam_rig motion T_rig_world. Constant; empty if all cameras have the same capture time and none was
  // moved relative to the rig.
  std::vector<SE3> motion;
  // Per pose: the velocity of the rig while its images were captured, rad/s and m/s, as in Rig::moving. Constant; empty
  // if it is not needed: all shutters are global, and their timing is constant.
  std::vector<geometry::Vector6d> twist;
  std::vector<std::uint8_t> pose_free;    // per pose
  std::vector<Vector3d> points;           // metres, world; all free
  std::vector<Observation> observations;  // sorted by (point, pose, camera)
};

struct BundleOptions {
  int iterations = 10;              // maximum number of steps, accepted or rejected
  double relative_decrease = 1e-4;  // converged if a step decreases the cost by a smaller fraction
  bool robust = true;               // Huber kernel with the threshold chi-square 5.991 (95 %, two dof)
  int dense_poses = 150;            // maximum number of free poses for a dense reduced camera system
  std::vector<int> marginals = {};  // free poses whose uncertainty is computed
  // A square root L, (n, any), of the covariance L L^T of the calibration, which the adjustment keeps constant. Rows:
  // rotation (rad) and translation (m) of cameras 1 to N-1, then the intrinsics of all cameras. Null if it is exact.
  std::shared_ptr<const Eigen::MatrixXd> rig_deviation = {};
  // Per pose: the effect of the calibration error L z, z ~ N(0, I), on a fixed pose; free poses have no columns. Empty:
  // none.
  // A fixed pose keeps its value in the adjustment, but with another calibration it would have had another value.
  std::vector<geometry::PoseUncertainty::Effect> fixed_effects = {};
  // If the calibration has not been compared with images yet: the inverse of its covariance, (n, n). The images of the
  // problem then add information about it. L, (n, n + 1), consists of a square root of the covariance of the estimate
  // from this prior and the images, and, in the last column, the difference between this estimate and the calibration.
  std::shared_ptr<const Eigen::MatrixXd> rig_prior = {};
  double correlated_observations = 1;  // number of observations that carry as much information as one, for `rig_prior`
};

struct BundleSummary : LmSummary {
  // One for each of BundleOptions::marginals if usable() and any observation is used, otherwise empty: given the fixed
  // poses, with all other poses and points marginalised out. PoseUncertainty::noise assumes the sigmas of the
  // observations, without scaling by the residuals. Nullopt if the pose has no observations that
  // are used, or if the observations do not determine the poses.
  std::vector<std::optional<geometry::PoseUncertainty>> uncertainties;
};

// Optimises the free poses and all points in place; on LmStop::kFailed, also if no observations remain, the problem is
// unchanged. At least one pose must be fixed; two if the scale is not observable. The following observations are
// ignored, also in the costs: those flagged in `skip` (one flag per observation, or empty), those that do not project
// or have a squared error above kMaxChi2 at the initial values, and those of points with fewer than two remaining
// observations. A stop request ends the optimisation after the current step and keeps the improvement so far. Bitwise
// deterministic.
BundleSummary adjust(ReprojectionProblem& problem, const BundleOptions& options,
                     std::span<const std::uint8_t> skip = {}, std::stop_token stop = {});

// Asserts that the sizes of a problem fit together and that its observations are in order and refer to its poses,
// points and cameras. Every function that reads the observations of a problem does this first.
void check_problem(const ReprojectionProblem& problem);

// The point of an observation in the frame of a camera when the row of the observed pixel was exposed. `point_rig`: the
// point at the time of the pose. `camera` is that of the observation, or one of the same model that may have taken it.
Vector3d point_in_camera(const ReprojectionProblem& problem, const RigValues& rig,
                         const ReprojectionProblem::Observation& observation, std::size_t camera,
                         const Vector3d& point_rig);
// The same for the observed point at its position in the problem, seen from the pose of the observation.
Vector3d point_in_camera(const ReprojectionProblem& problem, const RigValues& rig,
                         const ReprojectionProblem::Observation& observation, std::size_t camera);

// Squared normalised error of each observation at the problem's values; infinite if it does not project.
std::vector<double> squared_errors(const ReprojectionProblem& problem);
// Flags the errors that exceed `bound` or are NaN.
std::vector<std::uint8_t> beyond(const std::vector<double>& chi2, double bound);
// The errors at other values: one pose and point for each of the problem's poses and points.
std::vector<double> squared_errors(const ReprojectionProblem& problem, std::span<const SE3> T_rig_world,
                                   std::span<const Vector3d> points, const RigValues& rig);

}  // namespace bslam::solver
