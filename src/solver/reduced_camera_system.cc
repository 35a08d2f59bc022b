#include "solver/reduced_camera_system.h"

#include <Eigen/Cholesky>

namespace bslam::solver {

ReducedCameraSystem::ReducedCameraSystem(const BlockPattern& pattern, Storage storage)
    : pattern_(pattern), storage_(storage), blocks_(pattern.positions().size()), rhs_(6 * pattern.size()) {
  if (storage == Storage::kSparse) lay_out_sparse();
}

bool ReducedCameraSystem::solve(Eigen::VectorXd& delta) {
  if (pattern_.size() == 0) {
    delta.resize(0);
    return true;
  }
  const bool solved = storage_ == Storage::kDense ? solve_dense(delta) : solve_sparse(delta);
  return solved && delta.allFinite();
}

bool ReducedCameraSystem::solve_dense(Eigen::VectorXd& delta) {
  dense_.setZero(rhs_.size(), rhs_.size());
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const auto [row, column] = pattern_.positions()[b];
    dense_.block<6, 6>(6 * row, 6 * column) = blocks_[b];
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(dense_);
  if (factor.info() != Eigen::Success) return false;
  delta = factor.solve(rhs_);
  return true;
}

bool ReducedCameraSystem::solve_sparse(Eigen::VectorXd& delta) {
  fill_sparse();
  factor_.factorize(sparse_);
  if (factor_.info() != Eigen::Success) return false;
  delta = factor_.solve(rhs_);
  return true;
}

// Structure of the lower triangle, compressed by columns; values follow in the same order in fill_sparse.
void ReducedCameraSystem::lay_out_sparse() {
  const auto& positions = pattern_.positions();
  column_begin_.assign(static_cast<std::size_t>(pattern_.size()) + 1, 0);
  for (const auto& p : positions) ++column_begin_[static_cast<std::size_t>(p.column) + 1];
  for (std::size_t c = 1; c < column_begin_.size(); ++c) column_begin_[c] += column_begin_[c - 1];

  sparse_.resize(rhs_.size(), rhs_.size());
  sparse_.reserve(static_cast<Eigen::Index>(36 * positions.size()));
  for (int column = 0; column < 6 * pattern_.size(); ++column) {
    sparse_.startVec(column);
    const auto c = static_cast<std::size_t>(column / 6);
    for (std::size_t b = column_begin_[c]; b < column_begin_[c + 1]; ++b) {
      for (int row = 6 * positions[b].row; row < 6 * positions[b].row + 6; ++row) {
        if (row >= column) sparse_.insertBack(row, column) = 0.0;
      }
    }
  }
  sparse_.finalize();
  factor_.analyzePattern(sparse_);
}

void ReducedCameraSystem::fill_sparse() {
  double* value = sparse_.valuePtr();
  for (std::size_t c = 0; c + 1 < column_begin_.size(); ++c) {
    for (int k = 0; k < 6; ++k) {
      for (std::size_t b = column_begin_[c]; b < column_begin_[c + 1]; ++b) {
        for (int r = b == column_begin_[c] ? k : 0; r < 6; ++r) *value++ = blocks_[b](r, k);  // the first is diagonal
      }
    }
  }
}

}  // namespace bslam::solver
