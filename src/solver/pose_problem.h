// Motion-only bundle adjustment: the observations of one rig pose, sorted by camera.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "solver/lm.h"
#include "solver/pose_solver.h"

namespace bslam::solver {

// Normal equations for the left perturbation of T_rig_world. The cost is half the sum of the kernel costs of the items
// in use.
using PoseEquations = NormalEquations<6>;

class PoseProblem {
 public:
  struct Item {
    Vector3d point_world;  // metres
    Vector2d pixel;        // raw image
    double inverse_sigma;  // 1 / px
    CameraIndex camera;
    int observation;  // index in the caller's order
    bool in_use;
  };

  // `rig` and `motion` must outlive the problem. Without a motion all cameras have the same capture time.
  PoseProblem(const Rig& rig, std::span<const PoseObservation> observations, const MotionModel* motion = nullptr);

  const Rig& rig() const { return *rig_; }
  std::span<const Item> items() const { return items_; }

  // Uses the items whose squared error at a pose is at most `bound`. Returns the number of items that changed.
  int select(const SE3& T_rig_world, double bound);
  int num_in_use() const { return num_in_use_; }

  // Normal equations over the items in use; the second applies select(T_rig_world, bound) in the same pass.
  PoseEquations linearise(const SE3& T_rig_world, Kernel kernel) const;
  PoseEquations reselect_and_linearise(const SE3& T_rig_world, Kernel kernel, double bound, int& changed);

  // Sum of min(squared error, bound) over all items (MSAC). Returns a partial sum once it exceeds `limit`.
  double truncated_cost(const SE3& T_rig_world, double bound, double limit) const;

 private:
  std::span<Item> of_camera(std::size_t i) { return {items_.data() + first_[i], items_.data() + first_[i + 1]}; }
  std::span<const Item> of_camera(std::size_t i) const {
    return {items_.data() + first_[i], items_.data() + first_[i + 1]};
  }

  // T_cam_rig of camera i at the capture time of its image, and the (6, 6) Jacobian J of its pose: a perturbation delta
  // of the rig pose perturbs the camera pose by exp(J delta).
  struct CameraMotion {
    SE3 T_cam_rig;
    geometry::Matrix6d J;
    camera::Shutter shutter;
  };
  CameraMotion camera_motion(std::size_t i, const SE3& T_rig_world) const;

  const Rig* rig_;
  const MotionModel* motion_;
  std::vector<Item> items_;         // by camera, within a camera in the caller's order
  std::vector<std::size_t> first_;  // per camera, and the end
  int num_in_use_ = 0;
};

// Minimises the cost of the items in use, starting from `equations` at T_rig_world, until a step is shorter than
// `tolerance` standard deviations of the pose. Returns the resulting pose.
SE3 refine_pose(const PoseProblem& problem, const SE3& T_rig_world, const PoseEquations& equations, Kernel kernel,
                int iterations, double tolerance);

// Minimises in several rounds. Each round first selects the items whose squared error is at most a bound:
// `first_bound` in the first round, kChi2TwoDof95 in the others.
PoseSolution solve_rounds(PoseProblem& problem, const SE3& T_rig_world, double first_bound,
                          const PoseSolverOptions& options);

}  // namespace bslam::solver
