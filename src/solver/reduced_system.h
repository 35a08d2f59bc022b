// The linear system of bundle adjustment once the points are eliminated: sparse blocks of the frames, bordered by the
// dense block of the rig,
//     [ S    B ] [x_frames]   [r_frames]
//     [ B^T  C ] [x_rig   ] = [r_rig   ].
#pragma once

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <span>

#include "solver/block_matrix.h"

namespace bslam::solver {

// A diagonal entry of the normal equations as damping scales it: a direction without information is still damped a
// little.
inline double bounded_diagonal(double entry) { return std::clamp(entry, 1e-6, 1e32); }

class ReducedSystem {
 public:
  enum class Storage { kDense, kSparse };  // of the frames

  // `pattern` is numbered and outlives this; `frame_sizes`: unknowns of each frame. The rig may have none.
  ReducedSystem(const BlockPattern& pattern, std::span<const int> frame_sizes, int rig_size, Storage storage);

  BlockMatrix& frames() { return frames_; }  // S
  const BlockMatrix& frames() const { return frames_; }
  Eigen::MatrixXd& border() { return border_; }  // B: (frame unknowns, rig unknowns)
  Eigen::MatrixXd& rig() { return rig_; }        // C: lower triangle
  Eigen::VectorXd& rhs() { return rhs_; }        // frames, then rig

  // Factorises and solves; false where the matrix is not positive definite to machine precision.
  bool solve(Eigen::VectorXd& delta);
  // C - B^T S^-1 B, the information about the rig with the frames marginalised out. Valid after solve().
  const Eigen::MatrixXd& rig_information() const { return rig_information_; }

 private:
  template <class Factor>
  bool solve_with(const Factor& factor, Eigen::VectorXd& delta);

  Storage storage_;
  BlockMatrix frames_;
  Eigen::MatrixXd border_, rig_, rig_information_;
  Eigen::VectorXd rhs_;
  Eigen::MatrixXd dense_;
  Eigen::SparseMatrix<double> sparse_;  // lower triangle
  // Elimination order by approximate minimum degree; Eigen's own code, MPL-2.
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::AMDOrdering<int>> sparse_factor_;
};

}  // namespace bslam::solver
