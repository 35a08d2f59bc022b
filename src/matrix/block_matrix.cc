#include "matrix/block_matrix.h"

namespace bslam::matrix {

BlockMatrix::BlockMatrix(const BlockPattern& pattern, std::span<const int> sizes)
    : pattern_(pattern), offset_(1, 0), column_begin_(sizes.size() + 1, 0) {
  for (const int size : sizes) offset_.push_back(offset_.back() + size);
  std::size_t first = 0;
  for (const auto& [row, column] : pattern.positions()) {
    const Place place{first, sizes[static_cast<std::size_t>(row)], sizes[static_cast<std::size_t>(column)]};
    places_.push_back(place);
    first += static_cast<std::size_t>(place.rows) * static_cast<std::size_t>(place.columns);
    ++column_begin_[static_cast<std::size_t>(column) + 1];
  }
  for (std::size_t c = 1; c < column_begin_.size(); ++c) column_begin_[c] += column_begin_[c - 1];
  values_.assign(first, 0.0);
}

Eigen::Map<const Eigen::MatrixXd> BlockMatrix::block(int number) const {
  const Place& place = places_[static_cast<std::size_t>(number)];
  return {values_.data() + place.first, place.rows, place.columns};
}

void BlockMatrix::copy_to(Eigen::MatrixXd& out) const {
  for (std::size_t b = 0; b < places_.size(); ++b) {
    const auto [row, column] = pattern_.positions()[b];
    out.block(offset(row), offset(column), places_[b].rows, places_[b].columns) = block(static_cast<int>(b));
  }
}

// Calls visit(row, column, value) for each entry of the lower triangle, column by column and downwards within a column.
// The first block of a block column is the one on the diagonal.
template <class Visit>
void BlockMatrix::for_each_entry(const Visit& visit) const {
  for (std::size_t c = 0; c + 1 < column_begin_.size(); ++c) {
    for (int k = 0; k < offset_[c + 1] - offset_[c]; ++k) {
      for (std::size_t b = column_begin_[c]; b < column_begin_[c + 1]; ++b) {
        const Place& place = places_[b];
        const int row = offset(pattern_.positions()[b].row);
        const double* column = values_.data() + place.first + static_cast<std::size_t>(k * place.rows);
        for (int r = b == column_begin_[c] ? k : 0; r < place.rows; ++r) visit(row + r, offset_[c] + k, column[r]);
      }
    }
  }
}

Eigen::SparseMatrix<double> BlockMatrix::sparse_structure() const {
  Eigen::SparseMatrix<double> out(rows(), rows());
  out.reserve(static_cast<Eigen::Index>(values_.size()));
  int started = 0;
  for_each_entry([&](int row, int column, double) {
    while (started <= column) out.startVec(started++);
    out.insertBack(row, column) = 0.0;
  });
  out.finalize();
  return out;
}

void BlockMatrix::copy_to(Eigen::SparseMatrix<double>& out) const {
  double* next = out.valuePtr();
  for_each_entry([&](int, int, double value) { *next++ = value; });
}

}  // namespace bslam::matrix
