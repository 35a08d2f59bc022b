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
  // Optimisation rounds with reclassification of outliers between them. The last of two or more has no kernel; a single
  // one has it. 0: the observations are only classified at the initial pose.
  int rounds = 4;
  int iterations = 10;   // maximum number of Gauss-Newton steps per round
  int min_inliers = 10;  // minimum number of inliers of a pose
  double first_chi2 =
      kMaxChi2;  // maximum squared normalised error at the initial pose of observations of the first round

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("rounds", self.rounds, Range{1, 20}, "",
            "optimisation rounds with reclassification of outliers between them");
    visitor("iterations", self.iterations, Range{1, 100}, "", "maximum number of Gauss-Newton steps per round");
    visitor("min_inliers", self.min_inliers, Range{3, 1000}, "", "minimum number of inliers of a pose");
  }
};

// Motion of a rig during the capture of a frame whose cameras have different capture times: the twist at a pose is gain
// * log(T_rig_world T_before^-1) + offset. The dependence of the twist on the pose is part of the problem; otherwise an
// error of the pose would cause an error of the twist, and that an error of the next pose.
struct MotionModel {
  std::vector<double> delay_s;                             // per camera: capture time minus the time of the pose
  SE3 T_before;                                            // T_rig_world of the previous frame
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
  geometry::Matrix6d information = geometry::Matrix6d::Zero();  // information of the left perturbation
};

// Rounds with Huber kernel, each after a reclassification of all observations by chi-square (95 %, two degrees of
// freedom), which may readmit outliers; the last of two or more rounds uses the inliers without kernel. Without rounds
// the solution is the initial pose, with its inliers, their information and their errors. Observations may have any
// order. Deterministic; the order of the observations within a camera determines the order of summation. If the result
// is not ok, the pose must not be used.
PoseSolution solve_pose(const Rig& rig, std::span<const PoseObservation> observations, const SE3& T_rig_world_initial,
                        const PoseSolverOptions& options);
// The same for different capture times and the given motion model; `rig` is the rig at rest.
PoseSolution solve_pose(const Rig& rig, std::span<const PoseObservation> observations, const SE3& T_rig_world_initial,
                        const MotionModel& motion, const PoseSolverOptions& options);

}  // namespace bslam::solver
