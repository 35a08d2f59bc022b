#include "matrix/block_pattern.h"

#include <bit>

namespace bslam::matrix {

BlockPattern::BlockPattern(int size)
    : size_(size), bits_((static_cast<std::size_t>(size) * static_cast<std::size_t>(size) + 63) / 64, 0) {
  for (int i = 0; i < size; ++i) mark(i, i);
}

void BlockPattern::number() {
  before_.assign(bits_.size(), 0);
  positions_.clear();
  for (std::size_t word = 0; word < bits_.size(); ++word) {
    before_[word] = static_cast<int>(positions_.size());
    for (std::uint64_t rest = bits_[word]; rest != 0; rest &= rest - 1) {
      const std::size_t at = word * 64 + static_cast<std::size_t>(std::countr_zero(rest));
      positions_.push_back({static_cast<int>(at % static_cast<std::size_t>(size_)),
                            static_cast<int>(at / static_cast<std::size_t>(size_))});
    }
  }
}

int BlockPattern::index(int row, int column) const {
  const std::size_t at = bit(row, column);
  const std::uint64_t below = (std::uint64_t{1} << (at % 64)) - 1;
  return before_[at / 64] + std::popcount(bits_[at / 64] & below);
}

}  // namespace bslam::matrix
