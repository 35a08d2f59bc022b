// The part of the normal equations of bundle adjustment that belongs to the parameters of the rig: a dense block, its
// border with the frames, and its coupling with each point (docs/math.md, section 5).
#pragma once

#include <span>
#include <vector>

#include "solver/bundle_structure.h"
#include "solver/reduced_system.h"
#include "solver/rig_block.h"

namespace bslam::solver {

class RigTerms {
 public:
  using Matrix3d = geometry::Matrix3d;
  using Matrix63d = Eigen::Matrix<double, 6, 3>;

  // The arguments outlive this. `frame_unknowns`: of all frames together. Without blocks nothing of this costs
  // anything.
  RigTerms(const BundleStructure& structure, std::size_t num_cameras, const RigBlocks& blocks, int frame_unknowns);

  int size() const { return static_cast<int>(b_.size()); }  // unknowns of all blocks
  double prior_cost(const RigValues& values) const;
  // `delta`: of all blocks.
  void apply(const Eigen::VectorXd& delta, RigValues& values) const;

  // Sets all sums to the priors; the observations of a point follow begin_point(point).
  void begin(const RigValues& values);
  void begin_point(std::size_t point);
  // How the point of an observation depends on its pose and position.
  struct Point {
    const Vector3d& point_rig;
    const Matrix3d& R_rig_world;
    int pose_offset;  // first unknown of the pose; below zero where it is fixed
  };
  // `A`: d pixel / d point_rig and `e`: the error, both divided by sigma.
  void add(const RigObservation& observation, const Matrix23d& A, const Vector2d& e, double weight, const Point& point);

  // Writes the damped block, its border and right-hand side.
  void copy_to(double damping, ReducedSystem& system) const;
  // One point and a free pose: U = W L^-T and the first unknown of the pose.
  struct PoseCoupling {
    Matrix63d U;
    int pose_offset = 0;
  };
  // Subtracts what a point says of the rig, with V = L L^T the point's block and y = L^-1 b its right-hand side.
  void eliminate(std::size_t point, const Matrix3d& L, const Vector3d& y, std::span<const PoseCoupling> poses,
                 ReducedSystem& system);
  // Subtracts W^T delta of the rig's unknowns from the right-hand side of a point.
  void substitute(std::size_t point, const Eigen::VectorXd& delta, Vector3d& rhs) const;

  const Eigen::MatrixXd& H() const { return H_; }  // lower triangle
  const Eigen::VectorXd& b() const { return b_; }

 private:
  struct Coupling {  // of a point and an unknown of the rig
    int unknown = 0;
    Vector3d w;
  };

  const RigBlocks& blocks_;
  std::vector<int> first_of_block_;         // unknown, per block
  std::vector<std::vector<int>> unknowns_;  // per camera: those its pixels depend on
  Eigen::MatrixXd H_, border_;
  Eigen::VectorXd b_;
  std::vector<Coupling> couplings_;          // per point, unknowns ascending
  std::vector<std::size_t> first_coupling_;  // per point and one more
  std::vector<Coupling*> coupling_of_;       // per unknown, of the current point
  RigBlock::Jacobian J_;                     // scratch memory of one observation
  std::vector<Vector3d> u_;                  // and of one elimination: L^-1 w
};

}  // namespace bslam::solver
