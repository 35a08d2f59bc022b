// The linear system of bundle adjustment after elimination of the points: sparse blocks of the frames, bordered by the
// dense block of the rig,
//     [ S    B ] [x_frames]   [r_frames]
//     [ B^T  C ] [x_rig   ] = [r_rig   ].
#pragma once

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <span>

#include "geometry/so3.h"
#include "solver/block_matrix.h"

namespace bslam::solver {

// A diagonal entry of the normal equations for damping, bounded so that directions without information are damped a
// little.
inline double bounded_diagonal(double entry) { return std::clamp(entry, 1e-6, 1e32); }

class ReducedSystem {
 public:
  using Border = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  enum class Storage { kDense, kSparse };  // storage of the frames' blocks

  // `pattern` must be numbered and outlive the system. `frame_sizes`: unknowns of each frame. `rig_size` may be 0.
  ReducedSystem(const BlockPattern& pattern, std::span<const int> frame_sizes, int rig_size, Storage storage);

  BlockMatrix& frames() { return frames_; }  // S
  const BlockMatrix& frames() const { return frames_; }
  Border& border() { return border_; }     // B: (frame unknowns, rig unknowns)
  Eigen::MatrixXd& rig() { return rig_; }  // C: lower triangle
  Eigen::VectorXd& rhs() { return rhs_; }  // frames, then rig

  // Factorises and solves. Returns false if the matrix is not positive definite to machine precision.
  bool solve(Eigen::VectorXd& delta);
  // Factorises S. Returns false if it is not positive definite to machine precision.
  bool factorise();
  // The blocks of S^-1 of the poses of these frames: their covariances, given the rig. Valid after factorise().
  std::vector<geometry::Matrix6d> pose_covariances(std::span<const int> frames) const;
  // -S^-1 B: how the frames change with the rig's unknowns. Valid after factorise().
  Eigen::MatrixXd rig_sensitivity() const;
  // C - B^T S^-1 B, the information matrix of the rig with the frames marginalised out. Valid after solve().
  const Eigen::MatrixXd& rig_information() const { return rig_information_; }
  // The equations of the rig with the frames marginalised out, (C - B^T S^-1 B) x = r_rig - B^T S^-1 r_frames, which
  // may be singular. Valid after factorise().
  struct RigEquations {
    Eigen::MatrixXd information;
    Eigen::VectorXd rhs;
  };
  RigEquations rig_equations() const;

 private:
  // Whether S is factorised sparsely; without frames it never is.
  bool sparse() const { return storage_ == Storage::kSparse && frames_.rows() > 0; }
  // Factorises S and returns `use(factor)`.
  template <class Use>
  bool with_factor(const Use& use);
  geometry::Matrix6d dense_pose_covariance(int frame) const;
  template <class Factor>
  bool solve_with(const Factor& factor, Eigen::VectorXd& delta);

  Storage storage_;
  BlockMatrix frames_;
  Border border_;
  Eigen::MatrixXd rig_, rig_information_;
  Eigen::VectorXd rhs_;
  Eigen::MatrixXd dense_;
  Eigen::SparseMatrix<double> sparse_;  // lower triangle
  // Elimination order by approximate minimum degree. Uses Eigen's MPL-2 code only.
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::AMDOrdering<int>> sparse_factor_;
};

}  // namespace bslam::solver
