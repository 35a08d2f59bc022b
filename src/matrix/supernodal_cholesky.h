// Cholesky factorisation of large sparse matrices of blocks, as dense panels.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <span>
#include <vector>

#include "matrix/block_matrix.h"

namespace bslam::matrix {

// P A P^T = L L^T with a permutation P of blocks that keeps L sparse (approximate minimum degree, from Eigen's MPL-2
// code). Neighbouring columns of L with nearly the same rows are a supernode, which is stored as one dense panel, so
// that nearly all of the work is products of dense matrices (Ng, Peyton: "Block sparse Cholesky algorithms on advanced
// uniprocessor computers", 1993). The same matrix gives the same bits on every run; the products of very wide
// panels may be rounded differently on processors with caches of another size.
class SupernodalCholesky {
 public:
  // Analyses the pattern, which must be numbered. `sizes`: number of rows of each block row.
  SupernodalCholesky(const BlockPattern& pattern, std::span<const int> sizes);

  // `A` must have the pattern and sizes that were analysed. Returns false if it is not positive definite to machine
  // precision.
  bool factorise(const BlockMatrix& A);

  // A^-1 B, after a factorisation that succeeded.
  Eigen::MatrixXd solve(Eigen::MatrixXd B) const;

  // The factor L, with explicit zeros, and the row of P A P^T at which a block row of A begins.
  Eigen::SparseMatrix<double> factor() const;
  int position(int block_row) const {
    return begin_[static_cast<std::size_t>(place_[static_cast<std::size_t>(block_row)])];
  }

 private:
  struct Supernode {
    int first = 0, columns = 0;  // columns of L
    std::vector<int> rows;       // rows of L in ascending order, beginning with those of its columns
    std::size_t values = 0;      // offset of its panel, (rows, columns), column-major
    std::vector<int> blocks;     // blocks of A that belong to it
  };
  using Panel = Eigen::Map<Eigen::MatrixXd>;
  using ConstPanel = Eigen::Map<const Eigen::MatrixXd>;

  void make_supernodes(const std::vector<std::vector<int>>& structure);
  ConstPanel panel(const Supernode& s) const {
    return {values_.data() + s.values, static_cast<Eigen::Index>(s.rows.size()), s.columns};
  }
  Panel panel(const Supernode& s) {
    return {values_.data() + s.values, static_cast<Eigen::Index>(s.rows.size()), s.columns};
  }
  void assemble(const BlockMatrix& A, const Supernode& s);
  void subtract(const Supernode& descendant, std::size_t from, std::size_t to, const Supernode& s);
  bool eliminate(const Supernode& s);
  // To permuted rows and back.
  Eigen::MatrixXd permuted(const Eigen::MatrixXd& B, bool back) const;

  std::vector<BlockPattern::Position> positions_;  // positions of the blocks of A
  std::vector<int> size_, offset_;                 // per block row of A; offset of its rows
  std::vector<int> place_;                         // block row of P A P^T per block row of A
  std::vector<int> begin_;                         // first row per block row of P A P^T and one more
  std::vector<Supernode> supernodes_;
  std::vector<int> supernode_of_;  // per row of L
  std::vector<double> values_;
  std::vector<int> row_in_panel_;  // per row of L, of the supernode at work
  Eigen::MatrixXd update_;
};

}  // namespace bslam::matrix
