// Bundle adjustment as a least-squares problem (solver/lm.h): poses, points and the parameters of the rig, with the
// points eliminated by the Schur complement (docs/math.md, section 5). Used by the bundle adjustments of all folders.
#pragma once

#include <optional>
#include <vector>

#include "geometry/pose_uncertainty.h"
#include "solver/bundle_structure.h"
#include "solver/reduced_system.h"
#include "solver/rig_terms.h"

namespace bslam::solver {

// All points and poses of the problem. Only those in the structure are variables.
struct BundleState {
  std::vector<SE3> T_rig_world;
  std::vector<Vector3d> points;  // metres, world
  RigValues rig;
};

// The values of a problem, with those of its rig.
BundleState state_of(const ReprojectionProblem& problem);

class BundleEquations {
 public:
  using Matrix3d = geometry::Matrix3d;
  using Matrix6d = geometry::Matrix6d;
  using Vector6d = geometry::Vector6d;

  // `problem`, `structure` and `rig_blocks` must outlive the equations. `start`: initial values. Without rig blocks the
  // rig is constant. Systems with more free poses than `dense_poses` are solved sparsely.
  BundleEquations(const ReprojectionProblem& problem, const BundleStructure& structure, const RigBlocks& rig_blocks,
                  Kernel kernel, int dense_poses, BundleState start);

  // Interface for solver/lm.h. The cost is half the sum of kernel costs plus the priors of the rig blocks.
  double linearise();
  std::optional<double> solve(double damping);
  double trial_cost() { return cost(trial_); }
  void accept() { std::swap(state_, trial_); }

  const BundleState& state() const { return state_; }
  BundleState& state() { return state_; }

  // The equations of poses and rig of the last linearise(), with the points eliminated.
  ReducedSystem& reduce(double damping);
  // Information matrix of the rig's unknowns with poses and points marginalised out, including priors. Returns nullopt
  // if it is singular.
  std::optional<Eigen::MatrixXd> rig_information();
  // Factorises the equations of the poses with the points eliminated. Returns false if they are singular.
  bool factorise();
  // The equations of the rig with poses and points eliminated. Needs a successful factorise() since the last
  // linearise().
  ReducedSystem::RigEquations rig_equations() const { return system_.rig_equations(); }

  // Uncertainty of each of these poses at the last linearise(), with all other poses and points marginalised out: the
  // covariance for an exact rig, and the effect of the rig error rig_deviation z, z ~ N(0, I). Nullopt if the pose is
  // not a variable or the equations are singular. Effects need a successful factorise() or rig_information() since the
  // last linearise().
  std::vector<std::optional<geometry::Matrix6d>> pose_covariances(std::span<const int> poses);
  std::vector<std::optional<geometry::PoseUncertainty::Effect>> rig_effects(std::span<const int> poses,
                                                                            const Eigen::MatrixXd& rig_deviation) const;
  // The same for equations in which all poses are variables, some of which have given effects: `given` holds one for
  // each pose of the problem, without columns if it is not known. Reduces the equations of the last linearise().
  std::vector<std::optional<geometry::PoseUncertainty::Effect>> rig_effects(
      std::span<const int> poses, const Eigen::MatrixXd& rig_deviation,
      std::span<const geometry::PoseUncertainty::Effect> given);

  struct PoseBlock {
    Matrix6d H;  // lower triangle
    Vector6d b;
  };
  struct PointBlock {
    Matrix3d V;
    Vector3d b;
  };
  // The blocks computed by linearise(): per free pose, per point of the structure, and of the rig.
  const std::vector<PoseBlock>& pose_blocks() const { return pose_blocks_; }
  const std::vector<PointBlock>& point_blocks() const { return point_blocks_; }
  const RigTerms& rig_terms() const { return rig_; }

 private:
  using Matrix63d = Eigen::Matrix<double, 6, 3>;

  struct Rigid {
    Matrix3d R;
    Vector3d t;  // metres
  };
  // Sums over the observations of one group, for their point in the rig frame.
  struct GroupSums {
    Matrix3d M = Matrix3d::Zero();  // sum of w A^T A, A = J_h R_cam_rig / sigma
    Vector3d m = Vector3d::Zero();  // sum of w A^T e / sigma
    double cost = 0.0;
  };

  void set_poses(const BundleState& state);
  std::vector<std::optional<geometry::PoseUncertainty::Effect>> rows_of(std::span<const int> poses,
                                                                        const Eigen::MatrixXd& effect) const;
  int slot_of(int pose) const;  // -1 if the pose is not a variable
  const Rigid& cam_from_rig(int pose, int camera) const {
    return cam_from_rig_[static_cast<std::size_t>(pose) * cameras_ + static_cast<std::size_t>(camera)];
  }
  // A point in the frame of a camera when the row of a term's pixel was exposed.
  Vector3d in_camera(int pose, const BundleStructure::Term& term, const Vector3d& point_rig) const {
    const std::size_t k = static_cast<std::size_t>(pose) * cameras_ + static_cast<std::size_t>(term.camera);
    const Vector3d p = cam_from_rig_[k].R * point_rig + cam_from_rig_[k].t;
    return shutters_.empty() ? p : shutters_[k].at_row(p, static_cast<double>(term.pixel.y()));
  }
  // The velocity of a point in the frame of a camera, and the row of its pixel; zero if the velocity is not known.
  struct RowMotion {
    Vector3d velocity = Vector3d::Zero();
    double relative_row = 0.0;
  };
  RowMotion row_motion(int pose, const BundleStructure::Term& term, const Vector3d& point_cam) const {
    if (shutters_.empty()) return {};
    const auto camera = static_cast<std::size_t>(term.camera);
    const camera::Shutter& shutter = shutters_[static_cast<std::size_t>(pose) * cameras_ + camera];
    return {shutter.velocity_of(point_cam), problem_.rig->camera(camera).relative_row(term.pixel.y())};
  }
  // The derivative with respect to the point in the frame of the camera at the capture time, from that at the exposure.
  Matrix23d at_capture(const Matrix23d& J, int pose, const BundleStructure::Term& term) const {
    if (shutters_.empty()) return J;
    const auto camera = static_cast<std::size_t>(term.camera);
    return J * shutters_[static_cast<std::size_t>(pose) * cameras_ + camera].row_jacobian(term.pixel.y());
  }
  double cost(const BundleState& state);
  GroupSums sum_group(std::size_t group, const Rigid& pose, const Vector3d& point_rig);
  void add_to_pose(const GroupSums& sums, const Vector3d& point_rig, const Matrix3d& R_rig_world, PoseBlock& pose,
                   Matrix63d& W) const;
  void linearise_point(std::size_t point, double& sum);
  void eliminate_point(std::size_t point, double damping);
  Vector3d point_update(std::size_t point) const;

  const ReprojectionProblem& problem_;
  const BundleStructure& structure_;
  Kernel kernel_;
  std::size_t cameras_;
  BundleState state_, trial_;
  std::vector<Rigid> cam_from_rig_;        // (poses, cameras): T_cam_rig motion
  std::vector<camera::Shutter> shutters_;  // (poses, cameras); empty if none is rolling
  std::vector<Rigid> poses_;               // R_rig_world, t_rig_world; every pose of the problem
  std::vector<PoseBlock> pose_blocks_;     // per slot
  std::vector<PointBlock> point_blocks_;   // per point of the structure
  std::vector<Matrix63d> W_;               // per free group, in order
  std::vector<std::size_t> first_W_;       // per point and one more
  std::vector<Matrix3d> L_;                // per point: Cholesky factor of the damped V
  std::vector<RigTerms::PoseCoupling> U_;  // scratch memory of one elimination
  ReducedSystem system_;
  RigTerms rig_;
  Eigen::VectorXd delta_;  // frames, then rig
};

// The information of the priors of the blocks at these values, as it is part of the information of the rig.
Eigen::MatrixXd information_of_prior(const RigBlocks& blocks, const RigValues& values);

}  // namespace bslam::solver
