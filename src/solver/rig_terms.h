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

  // The arguments must outlive the terms. `frame_unknowns`: number of unknowns of all frames. Without blocks all
  // functions return immediately.
  RigTerms(const BundleStructure& structure, std::size_t num_cameras, const RigBlocks& blocks, int frame_unknowns);

  int size() const { return static_cast<int>(b_.size()); }  // number of unknowns of all blocks
  double prior_cost(const RigValues& values) const;
  // `delta`: step of the unknowns of all blocks.
  void apply(const Eigen::VectorXd& delta, RigValues& values) const;

  // Sets all sums to the priors. Call begin_point(point) before adding the observations of a point.
  void begin(const RigValues& values);
  void begin_point(std::size_t point);
  // The point of an observation and its pose.
  struct Point {
    const Vector3d& point_rig;
    const Matrix3d& R_rig_world;
    int pose_offset;  // first unknown of the pose; negative if it is fixed
  };
  // `A`: d pixel / d point_rig. `e`: the error. Both divided by sigma.
  void add(const RigObservation& observation, const Matrix23d& A, const Vector2d& e, double weight, const Point& point);

  // Writes the damped block, its border and right-hand side.
  void copy_to(double damping, ReducedSystem& system) const;
  // Coupling of a point and a free pose: U = W L^-T, and the first unknown of the pose.
  struct PoseCoupling {
    Matrix63d U;
    int pose_offset = 0;
  };
  // Eliminates a point from the rig's equations. V = L L^T is the point's block and y = L^-1 b its right-hand side.
  void eliminate(std::size_t point, const Matrix3d& L, const Vector3d& y, std::span<const PoseCoupling> poses,
                 ReducedSystem& system);
  // Subtracts W^T delta for the rig's unknowns from the right-hand side of a point.
  void substitute(std::size_t point, const Eigen::VectorXd& delta, Vector3d& rhs) const;

  const Eigen::MatrixXd& H() const { return H_; }  // lower triangle
  const Eigen::VectorXd& b() const { return b_; }

 private:
  // Consecutive unknowns of the rig, and where they begin among those that are coupled with a point.
  struct Run {
    int unknown = 0, size = 0, first = 0;
  };

  void couple(const BundleStructure& structure);

  const RigBlocks& blocks_;
  std::vector<int> first_of_block_;       // per block: its first unknown
  std::vector<std::vector<Run>> ranges_;  // per camera: the unknowns on which its pixels depend, one range per block
  Eigen::MatrixXd H_;
  ReducedSystem::Border border_;
  Eigen::VectorXd b_;
  std::vector<double> W_;                    // coupling of each point with its unknowns: three rows, point by point
  std::vector<std::size_t> first_coupling_;  // per point, and the end: number of unknowns of all points before
  std::vector<Run> runs_;                    // runs of each point, ascending
  std::vector<std::size_t> first_run_;       // per point, and the end
  double* W_of_point_ = nullptr;             // the rows of W_ of the current point,
  std::ptrdiff_t W_columns_ = 0;             // their number of columns,
  std::vector<int> column_of_;               // and, per unknown, its column
  RigBlock::Jacobian J_, wJ_;                // scratch memory of one observation: J and its weighted copy
  std::vector<double> U_;                    // scratch memory of one elimination: the rows of L^-1 W
};

}  // namespace bslam::solver
