// Pattern of the nonzero blocks of a symmetric matrix: the covisibility of free poses in the reduced camera system.
#pragma once

#include <cstdint>
#include <vector>

namespace bslam::matrix {

// Lower triangle including the diagonal. Call mark() for all blocks, then number(), then index(), which needs no
// search.
class BlockPattern {
 public:
  struct Position {
    int row = 0, column = 0;  // row >= column
  };

  explicit BlockPattern(int size);

  int size() const { return size_; }
  void mark(int row, int column) { bits_[bit(row, column) / 64] |= std::uint64_t{1} << (bit(row, column) % 64); }
  // Numbers the marked blocks column by column, downwards within a column.
  void number();
  // Number of a marked block.
  int index(int row, int column) const;
  const std::vector<Position>& positions() const { return positions_; }

 private:
  std::size_t bit(int row, int column) const {
    return static_cast<std::size_t>(column) * static_cast<std::size_t>(size_) + static_cast<std::size_t>(row);
  }

  int size_;
  std::vector<std::uint64_t> bits_;
  std::vector<int> before_;  // number of marked blocks before each word of bits_
  std::vector<Position> positions_;
};

}  // namespace bslam::matrix
