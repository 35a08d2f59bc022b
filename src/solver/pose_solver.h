// Motion-only bundle adjustment: the pose of camera 0 from all cameras (the paper's tracking equation).
#pragma once

#include <span>
#include <vector>

#include "base/options.h"
#include "solver/reprojection.h"

namespace bslam::solver {

struct PoseObservation {
  CameraIndex camera;
  Vector3d point_world;  // metres
  Vector2d pixel;        // raw image
  double sigma = 1.0;    // px, per axis
};

struct PoseSolverOptions {
  int rounds = 4;        // solves with re-classification of outliers between them; the last one without robust kernel
  int iterations = 10;   // Gauss-Newton steps a round at most
  int min_inliers = 10;  // fewer say nothing about a pose
  double first_chi2 =
      kMaxChi2;  // squared normalised error at the guess beyond which an observation waits for the second round

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("rounds", self.rounds, Range{1, 20}, "", "solve rounds with re-classification of outliers between them");
    visitor("iterations", self.iterations, Range{1, 100}, "", "Gauss-Newton steps a round at most");
    visitor("min_inliers", self.min_inliers, Range{3, 1000}, "", "fewer inliers say nothing about a pose");
  }
};

// How a rig whose cameras fire one after the other goes on moving from its pose, given the one before it: the twist at
// a pose is gain * log(T_rig_world T_before^-1) + offset. Its dependence on the pose is part of the problem: left out,
// an error of the pose would make one of the twist, and that the next of the pose.
struct MotionModel {
  std::vector<double> delay_s;                             // per camera: time of its image after that of the pose
  SE3 T_before;                                            // T_rig_world of the frame before
  double gain = 0.0;                                       // 1/s
  geometry::Vector6d offset = geometry::Vector6d::Zero();  // rad/s, m/s

  // Logarithm of the motion since the frame before.
  geometry::Vector6d step(const SE3& T_rig_world) const { return (T_rig_world * T_before.inverse()).log(); }
  geometry::Vector6d twist(const SE3& T_rig_world) const { return gain * step(T_rig_world) + offset; }
};

struct PoseSolution {
  bool ok = false;  // enough inliers and a well-conditioned system
  SE3 T_rig_world;
  std::vector<std::uint8_t> inlier;  // per observation
  int num_inliers = 0;
  std::vector<int> inliers_per_camera;
  geometry::Matrix6d information = geometry::Matrix6d::Zero();  // of the left perturbation, at the solution
  double mean_chi2 = 0.0;                                       // over the inliers, per observation
};

// Huber rounds, each from a re-classification of all observations by chi-square (95 %, two degrees of freedom), also
// back in; the last over the inliers without kernel. Observations in any order; their order within a camera fixes the
// order of the sums. Deterministic. Not ok: the pose is the best found and nothing to rely on.
PoseSolution solve_pose(const Rig& rig, std::span<const PoseObservation> observations, const SE3& T_rig_world_guess,
                        const PoseSolverOptions& options);
// The same with cameras that move as the model says; `rig` is the rig at rest.
PoseSolution solve_pose(const Rig& rig, std::span<const PoseObservation> observations, const SE3& T_rig_world_guess,
                        const MotionModel& motion, const PoseSolverOptions& options);

}  // namespace bslam::solver
