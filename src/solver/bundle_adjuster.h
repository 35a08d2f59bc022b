// Bundle adjustment over rig poses and points by Levenberg-Marquardt and the Schur complement. Local and global BA are
// the same problem with other variables free. It knows no map.
#pragma once

#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "base/options.h"
#include "solver/reprojection.h"

namespace bslam::solver {

// Flat: observations refer to poses and points by position. A pose is that of the rig, so N cameras do not enlarge it.
struct ReprojectionProblem {
  struct Observation {
    int pose = 0, point = 0;
    CameraIndex camera;
    Eigen::Vector2f pixel;  // raw image
    float sigma = 1.0f;     // px, per axis
  };
  const Rig* rig = nullptr;  // extrinsics are constant, as in the paper
  std::vector<SE3> T_rig_world;
  // (poses, cameras) row-major, how the rig moved between the time of a pose and that of a camera's image: T_cam_world =
  // T_cam_rig motion T_rig_world. Constant; empty where all cameras fired together.
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

enum class BundleStop { kConverged, kIterations, kStopped, kFailed };

struct BundleSummary {
  struct Step {
    double cost = 0, damping = 0, step_norm = 0;
    bool accepted = false;
  };
  BundleStop stop = BundleStop::kFailed;
  double initial_cost = 0, final_cost = 0;  // sum of (robust) normalised squared errors / 2
  std::vector<Step> steps;
  bool usable() const { return stop != BundleStop::kFailed; }
};

// Improves the free poses and all points in place; on kFailed the problem is as it was (also where nothing is left to
// learn from). At least one pose is fixed; a map up to scale keeps its scale by two fixed poses. `skip` (one per
// observation, or empty) leaves observations out. So are, for the call, observations that do not project or miss by
// more than kLostChi2 at the start, and points with fewer than two observations left; the costs do not count them. A
// stop request ends it after the step in hand, keeping what was gained. Deterministic to the bit.
BundleSummary adjust(ReprojectionProblem& problem, const BundleOptions& options,
                     std::span<const std::uint8_t> skip = {}, std::stop_token stop = {});

// T_cam_rig of a camera at the time of its own image.
SE3 cam_from_rig_at(const ReprojectionProblem& problem, std::size_t pose, CameraIndex camera);

// Squared normalised error of each observation at the present values; infinite where it does not project.
std::vector<double> squared_errors(const ReprojectionProblem& problem);
// Flags those of them that are not at most `bound`.
std::vector<std::uint8_t> beyond(const std::vector<double>& chi2, double bound);
// The errors at other values, extrinsics included; one per pose, point and camera of the problem.
std::vector<double> squared_errors(const ReprojectionProblem& problem, std::span<const SE3> T_rig_world,
                                   std::span<const Vector3d> points, std::span<const SE3> T_cam_rig);

}  // namespace bslam::solver
