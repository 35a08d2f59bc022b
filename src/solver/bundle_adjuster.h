// Bundle adjustment over rig poses and points by Levenberg-Marquardt and the Schur complement. Local and global bundle
// adjustment are the same problem with other variables free. Independent of the map.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "base/options.h"
#include "solver/lm.h"
#include "solver/reprojection.h"

namespace bslam::solver {

// Observations refer to poses and points by position. Poses are those of the rig: N cameras add no unknowns.
struct ReprojectionProblem {
  struct Observation {
    int pose = 0, point = 0;
    CameraIndex camera;
    Eigen::Vector2f pixel;  // raw image
    float sigma = 1.0f;     // px, per axis
  };
  const Rig* rig = nullptr;
  std::vector<SE3> T_rig_world;
  // (poses, cameras) row-major: the motion of the rig between the time of a pose and that of a camera's image,
  // T_cam_world = T_cam_rig motion T_rig_world. Constant; empty where all cameras have the same time.
  std::vector<SE3> motion;
  std::vector<std::uint8_t> pose_free;    // per pose
  std::vector<Vector3d> points;           // metres, world; all free
  std::vector<Observation> observations;  // sorted by (point, pose, camera)
};

struct BundleOptions {
  int iterations = 10;              // accepted or rejected steps at most
  double relative_decrease = 1e-4;  // of the cost, below which it has converged
  bool robust = true;               // Huber kernel at the 95 % bound
  int dense_poses = 150;            // free poses up to which the reduced camera system is solved densely
};

// Improves the free poses and all points in place; on LmStop::kFailed the problem is unchanged (also where no
// observation is left). At least one pose is fixed; two fixed poses hold the scale of a map whose scale is not
// observable. Left out, also of the costs, are the observations flagged in `skip` (one flag per observation, or empty),
// those that do not project or have a squared error above kMaxChi2 at the start, and points with fewer than two
// observations left. A stop request ends it after the current step and keeps the improvement so far. Deterministic to
// the bit.
LmSummary adjust(ReprojectionProblem& problem, const BundleOptions& options, std::span<const std::uint8_t> skip = {},
                 std::stop_token stop = {});

// Squared normalised error of each observation at the problem's values; infinite where it does not project.
std::vector<double> squared_errors(const ReprojectionProblem& problem);
// Flags the errors that are not at most `bound`.
std::vector<std::uint8_t> beyond(const std::vector<double>& chi2, double bound);
// The errors at other values: one pose, point and T_cam_rig for each of the problem's poses, points and cameras.
std::vector<double> squared_errors(const ReprojectionProblem& problem, std::span<const SE3> T_rig_world,
                                   std::span<const Vector3d> points, std::span<const SE3> T_cam_rig);

}  // namespace bslam::solver
