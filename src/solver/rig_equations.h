// Normal equations of an adjustment over rig poses, points and the extrinsics of cameras 1 to N-1: linearised once, damped
// and solved many times.
#pragma once

#include <optional>
#include <vector>

#include "solver/bundle_structure.h"

namespace bslam::solver {

// The residual e = u - h_i(T_i0 motion (R_0w P + t_0w)) with the extrinsics as a variable.
struct RigResidual {
  Vector2d error;           // px
  Matrix26d J_pose;         // de / d(left perturbation of T_rig_world, rotation first)
  Matrix26d J_extrinsics;   // de / d(left perturbation of T_cam_rig) = -J_h [-[p]x I], p in the camera frame
  Matrix23d J_point;        // de / dP

  // Empty where the camera does not project the point.
  static std::optional<RigResidual> evaluate(const camera::Camera& camera, const SE3& T_cam_rig, const SE3& motion,
                                             const SE3& T_rig_world, const Vector3d& point_world, const Vector2d& pixel);
};

// What calibration says: each camera's extrinsics are normally distributed about the calibrated ones, alike in all axes.
struct ExtrinsicPrior {
  std::vector<SE3> T_cam_rig;  // calibrated, per camera; camera 0 is the identity
  double sigma_rotation = 0, sigma_translation = 0;  // radians, metres
};

// How far extrinsics are from others: of D = T_cam_rig reference^-1, log of the rotation (radians), then the translation
// (metres), both in axes of the camera. The length of the latter is how far the camera's centre moved.
geometry::Vector6d extrinsic_change(const SE3& T_cam_rig, const SE3& reference);

// The variables. Points are all of the problem's, poses and cameras too; only what the structure uses moves.
struct RigState {
  std::vector<SE3> T_rig_world;
  std::vector<Vector3d> points;  // metres, world
  std::vector<SE3> T_cam_rig;    // per camera
};

// Dense in poses and cameras: memory grows with the square, time with the cube of their number. The unknowns are six of
// each free pose, then six of each camera but the first.
class RigEquations {
 public:
  // All arguments outlive this. The problem's poses, points and extrinsics are not read.
  RigEquations(const ReprojectionProblem& problem, const BundleStructure& structure, Kernel kernel, const ExtrinsicPrior& prior);

  // Sum of kernel costs / 2, with that of the prior, at a state.
  double cost(const RigState& state) const;
  // The same, and keeps the normal equations there.
  double linearise(const RigState& state);

  struct Step {
    double predicted = 0.0;  // decrease of the cost by the quadratic model
    RigState to;
  };
  // Empty where the damped system is not positive definite.
  std::optional<Step> solve(double damping, const RigState& from);

  // What is known of the extrinsics where it was linearised: (6(N-1), 6(N-1)) each, of left perturbations. Empty where the
  // system is not positive definite.
  struct Information {
    Eigen::MatrixXd observed;  // by the observations alone, poses and points being free
    Eigen::MatrixXd prior;
  };
  std::optional<Information> extrinsic_information();

 private:
  using Matrix3d = geometry::Matrix3d;
  using Matrix6d = geometry::Matrix6d;
  using Vector6d = geometry::Vector6d;
  using Matrix63d = Eigen::Matrix<double, 6, 3>;

  // A point and a pose or camera.
  struct Coupling {
    int block = 0;
    Matrix63d W = Matrix63d::Zero();
  };
  struct PointBlock {
    Matrix3d V = Matrix3d::Zero();
    Vector3d b = Vector3d::Zero();
  };

  int num_poses() const { return static_cast<int>(structure_.pose_of_slot.size()); }
  // Block of a camera's extrinsics; below zero for camera 0, which has none.
  int camera_block(int camera) const { return camera == 0 ? -1 : num_poses() + camera - 1; }
  const SE3& motion(int pose, int camera) const;
  double prior_cost(const RigState& state) const;
  void couple();
  double linearise_point(std::size_t point, const RigState& state);
  void add_term(const RigResidual& residual, double weight, int slot, int camera, std::size_t point, Coupling* of_pose);
  void add_prior(const RigState& state);
  bool reduce(double damping);
  void eliminate(std::size_t point, double damping);
  Vector3d point_update(std::size_t point, double damping, const Eigen::VectorXd& delta) const;

  const ReprojectionProblem& problem_;
  const BundleStructure& structure_;
  Kernel kernel_;
  const ExtrinsicPrior& prior_;
  std::vector<Coupling> couplings_;          // per point: its free poses, then its cameras, blocks ascending
  std::vector<std::size_t> first_coupling_;  // per point and one more
  std::vector<PointBlock> points_;
  std::vector<Coupling*> of_camera_;  // per camera, of one point
  std::vector<Matrix63d> U_;          // W L^-T of one point
  Eigen::MatrixXd H_, S_;             // lower triangles
  Eigen::MatrixXd prior_information_;  // of the extrinsics, contained in H_
  Eigen::VectorXd b_, r_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

}  // namespace bslam::solver
