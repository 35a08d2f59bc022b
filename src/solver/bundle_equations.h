// Normal equations of a bundle adjustment: linearised once, damped and solved many times (docs/math.md, section 5).
#pragma once

#include <array>
#include <vector>

#include "solver/bundle_structure.h"
#include "solver/reduced_camera_system.h"

namespace bslam::solver {

// The variables of an adjustment. Points are all of the problem's, poses too; only what the structure uses moves.
struct BundleState {
  std::vector<SE3> T_rig_world;
  std::vector<Vector3d> points;  // metres, world
};

// Holds the scratch memory of one adjustment.
class BundleEquations {
 public:
  // `problem` and `structure` outlive this. More free poses than `dense_poses` are solved sparsely.
  BundleEquations(const ReprojectionProblem& problem, const BundleStructure& structure, Kernel kernel, int dense_poses);

  // Sum of kernel costs / 2 at a state.
  double cost(const BundleState& state);
  // The same, and keeps the normal equations there.
  double linearise(const BundleState& state);

  struct Step {
    double predicted = 0.0;  // decrease of the cost by the quadratic model
    double norm = 0.0;       // of all updates together: radians and metres
  };
  // Solves the equations with `damping` times their (bounded) diagonal added and applies the solution to `from`.
  // False where the system is not positive definite.
  bool solve(double damping, const BundleState& from, BundleState& to, Step& step);

 private:
  using Matrix3d = geometry::Matrix3d;
  using Matrix6d = geometry::Matrix6d;
  using Vector6d = geometry::Vector6d;
  using Matrix63d = Eigen::Matrix<double, 6, 3>;

  struct Rigid {
    Matrix3d R;
    Vector3d t;  // metres
  };
  struct PoseBlock {
    Matrix6d H;
    Vector6d b;
  };
  struct PointBlock {
    Matrix3d V;  // symmetric
    Vector3d b;
  };
  // What the terms of one group say about their point in the rig frame.
  struct GroupSums {
    Matrix3d M = Matrix3d::Zero();  // sum of w A^T A, A = J_h R_cam_rig / sigma
    Vector3d m = Vector3d::Zero();  // sum of w A^T e / sigma
    double cost = 0.0;
  };

  void set_poses(const std::vector<SE3>& T_rig_world);
  const Rigid& cam_from_rig(int pose, int camera) const {
    return cam_from_rig_[static_cast<std::size_t>(pose) * models_.size() + static_cast<std::size_t>(camera)];
  }
  GroupSums sum_group(std::size_t group, const Vector3d& point_rig) const;
  void add_to_pose(const GroupSums& sums, const Vector3d& point_rig, const Matrix3d& R_rig_world, PoseBlock& pose,
                   Matrix63d& W) const;
  void eliminate_points(double damping);
  void eliminate_point(std::size_t point, double damping);
  Vector3d point_update(std::size_t point) const;

  const BundleStructure& structure_;
  Kernel kernel_;
  std::vector<const camera::CameraModel*> models_;  // per camera
  std::vector<Rigid> cam_from_rig_;                 // (poses, cameras), T_cam_rig motion: constant over an adjustment
  std::vector<Rigid> poses_;            // R_rig_world, t_rig_world; every pose of the problem
  std::vector<PoseBlock> pose_blocks_;  // per slot
  std::vector<PointBlock> point_blocks_;
  std::vector<Matrix63d> W_;          // per free group, in order
  std::vector<std::size_t> first_W_;  // per point and one more
  std::vector<Matrix3d> L_;           // per point: Cholesky factor of the damped V
  std::vector<Matrix63d> U_;          // W L^-T of one point
  ReducedCameraSystem system_;
  Eigen::VectorXd delta_;  // per slot, six each
};

}  // namespace bslam::solver
