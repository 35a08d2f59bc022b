// The part of the normal equations of bundle adjustment that belongs to the parameters of the rig: a dense block, its
// border with the frames, and its coupling with each point (docs/math.md, section 5).
#pragma once

#include <span>
#include <vector>

#include "solver/bundle_structure.h"
#include "solver/point_ranges.h"
#include "solver/reduced_system.h"
#include "solver/rig_block.h"

namespace bslam::solver {

class RigTerms {
 public:
  using Matrix3d = geometry::Matrix3d;
  using Matrix63d = Eigen::Matrix<double, 6, 3>;
  using Matrix32d = Eigen::Matrix<double, 3, 2>;

  // The arguments must outlive the terms. `frame_unknowns`: number of unknowns of all frames. Without blocks all
  // functions return immediately.
  RigTerms(const BundleStructure& structure, std::size_t num_cameras, const RigBlocks& blocks, int frame_unknowns);

  int size() const { return static_cast<int>(b_.size()); }  // number of unknowns of all blocks
  double prior_cost(const RigValues& values) const;
  // `delta`: step of the unknowns of all blocks.
  void apply(const Eigen::VectorXd& delta, RigValues& values) const;

  // Sets all sums to the priors.
  void begin(const RigValues& values);
  // The observations of a range of points are added in two steps: add() computes what belongs to one observation and
  // its point, and may be called by several threads for different points; accumulate() adds all of them, in their
  // order, to the sums.
  void begin_points(const PointRange& range);
  void begin_point(std::size_t point);
  // Every observation of the range is either added or left out.
  void leave_out(std::size_t term) { added_[term - range_.first_term].camera = -1; }
  // The point of an observation and its pose.
  struct Point {
    std::size_t index;  // in the structure
    const Vector3d& point_rig;
    const Matrix3d& R_rig_world;
    int pose_offset;  // first unknown of the pose; negative if it is fixed
  };
  // `term`: index of the observation in the structure. `A`: d pixel / d point_rig. `e`: the error. Both divided by
  // sigma.
  void add(std::size_t term, const RigObservation& observation, const Matrix23d& A, const Vector2d& e, double weight,
           const Point& point);
  // Adds the observations of every shares-th camera to the sums, which no other share changes.
  void accumulate(std::size_t share, std::size_t shares);

  // Writes the damped block, its border and right-hand side.
  void copy_to(double damping, ReducedSystem& system) const;
  // Coupling of a point and a free pose: U = W L^-T, the slot of the pose and its first unknown.
  struct PoseCoupling {
    Matrix63d U;
    int slot = 0, pose_offset = 0;
  };
  // A point is eliminated in three steps. V = L L^T is its block and y = L^-1 b its right-hand side.
  // couple() computes U = L^-1 W for a point of the range of begin_points(); several threads may do this for different
  // points. The other two eliminate the point from the border of a pose, and from a share of the rig's unknowns.
  void couple(std::size_t point, const Matrix3d& L);
  void eliminate_from(const PoseCoupling& pose, std::size_t point, ReducedSystem& system) const;
  void eliminate(std::size_t point, const Vector3d& y, std::size_t share, std::size_t shares,
                 ReducedSystem& system) const;
  // Subtracts W^T delta for the rig's unknowns from the right-hand side of a point.
  void substitute(std::size_t point, const Eigen::VectorXd& delta, Vector3d& rhs) const;

  const Eigen::MatrixXd& H() const { return H_; }  // lower triangle
  const Eigen::VectorXd& b() const { return b_; }

 private:
  // Consecutive unknowns of the rig, and where they begin among those that are coupled with a point.
  struct Run {
    int unknown = 0, size = 0, first = 0;
  };

  // What add() computes of an observation, except its Jacobian.
  struct Added {
    int camera;       // -1: it is left out
    int pose_offset;  // as in Point
    double weight;
    Vector2d weighted_error;
    Matrix62d to_pose;  // G^T A^T w
  };

  void find_couplings(const BundleStructure& structure);
  std::span<const Run> runs_of(std::size_t point) const {
    return {runs_.data() + first_run_[point], first_run_[point + 1] - first_run_[point]};
  }
  std::ptrdiff_t num_coupled(std::size_t point) const {
    return static_cast<std::ptrdiff_t>(first_coupling_[point + 1] - first_coupling_[point]);
  }
  void add_to_point(std::size_t point, std::span<const Run> ranges, const Matrix32d& to_point, const double* J);
  void accumulate(const Added& term, const double* J, double* weighted_J);

  const BundleStructure& structure_;
  const RigBlocks& blocks_;
  std::vector<int> first_of_block_;       // per block: its first unknown
  std::vector<std::vector<Run>> ranges_;  // per camera: the unknowns on which its pixels depend, one range per block
  std::vector<std::size_t> sharing_;      // per camera: the first camera that has unknowns in common with it
  std::ptrdiff_t columns_ = 0;            // maximum number of unknowns on which the pixels of one camera depend
  Eigen::MatrixXd H_;
  ReducedSystem::Border border_;
  Eigen::VectorXd b_;
  std::vector<double> W_;                    // coupling of each point with its unknowns: three rows, point by point
  std::vector<std::size_t> first_coupling_;  // per point, and the end: number of unknowns of all points before
  std::vector<Run> runs_;                    // runs of each point, ascending
  std::vector<std::size_t> first_run_;       // per point, and the end
  // Scratch memory of a range of points: of its observations, their Jacobians in two rows of columns_ numbers each, and
  // U in the order of W.
  PointRange range_;
  std::vector<Added> added_;
  std::vector<double> J_, U_;
};

}  // namespace bslam::solver
