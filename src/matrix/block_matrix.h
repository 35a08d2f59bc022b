// Symmetric sparse matrix of dense blocks, stored as its lower triangle, for the normal equations of poses.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <span>
#include <vector>

#include "matrix/block_pattern.h"

namespace bslam::matrix {

class BlockMatrix {
 public:
  // `sizes`: number of rows of each block row. `pattern` must be numbered and must outlive the matrix. All entries are
  // zero.
  BlockMatrix(const BlockPattern& pattern, std::span<const int> sizes);

  int rows() const { return offset_.back(); }
  // First row of a block row.
  int offset(int block_row) const { return offset_[static_cast<std::size_t>(block_row)]; }
  void set_zero() { std::fill(values_.begin(), values_.end(), 0.0); }

  // A block by its number in the pattern. Only the lower triangle of diagonal blocks is used.
  Eigen::Map<const Eigen::MatrixXd> block(int number) const;
  // Its leading (N, N) part.
  template <int N>
  auto leading(int number) {
    const Place& place = places_[static_cast<std::size_t>(number)];
    using Leading = Eigen::Map<Eigen::Matrix<double, N, N>, 0, Eigen::OuterStride<>>;
    return Leading(values_.data() + place.first, Eigen::OuterStride<>(place.rows));
  }

  // Writes the lower triangle and leaves the rest of `out` unchanged.
  void copy_to(Eigen::MatrixXd& out) const;
  // The non-zero entries of the lower triangle, compressed by columns; copy_to then writes the values.
  Eigen::SparseMatrix<double> sparse_structure() const;
  void copy_to(Eigen::SparseMatrix<double>& out) const;

 private:
  struct Place {
    std::size_t first = 0;  // index in values_, column-major
    int rows = 0, columns = 0;
  };
  template <class Visit>
  void for_each_entry(const Visit& visit) const;

  const BlockPattern& pattern_;
  std::vector<int> offset_;                // per block row and one more
  std::vector<Place> places_;              // per block
  std::vector<std::size_t> column_begin_;  // first block of each block column and one more
  std::vector<double> values_;
};

}  // namespace bslam::matrix
