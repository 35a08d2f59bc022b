// The reduced camera system S delta = r of bundle adjustment: symmetric positive definite, in 6x6 blocks of free poses.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCholesky>

#include "geometry/so3.h"
#include "solver/block_pattern.h"

namespace bslam::solver {

class ReducedCameraSystem {
 public:
  enum class Storage { kDense, kSparse };

  // `pattern` is numbered and outlives this.
  ReducedCameraSystem(const BlockPattern& pattern, Storage storage);

  // Blocks in the pattern's numbering; of those on the diagonal only the lower triangle is read.
  std::vector<geometry::Matrix6d>& blocks() { return blocks_; }
  Eigen::VectorXd& rhs() { return rhs_; }

  // Factorises (LL^T) and solves; false where S is not positive definite to machine precision.
  bool solve(Eigen::VectorXd& delta);

 private:
  bool solve_dense(Eigen::VectorXd& delta);
  bool solve_sparse(Eigen::VectorXd& delta);
  void lay_out_sparse();
  void fill_sparse();

  const BlockPattern& pattern_;
  Storage storage_;
  std::vector<geometry::Matrix6d> blocks_;
  Eigen::VectorXd rhs_;
  Eigen::MatrixXd dense_;
  Eigen::SparseMatrix<double> sparse_;     // lower triangle
  std::vector<std::size_t> column_begin_;  // first block of each block column, and one more
  // Elimination order by approximate minimum degree; Eigen's own code, MPL-2.
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::AMDOrdering<int>> factor_;
};

}  // namespace bslam::solver
