// A set of ids that are near each other.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace bslam {

// Takes one byte for each id between the smallest and the largest one that it may contain.
template <class Id>
class IdSet {
 public:
  // An empty set, into which these ids may be inserted.
  explicit IdSet(std::span<const Id> ids) {
    if (ids.empty()) return;
    const auto [low, high] = std::ranges::minmax(ids);
    first_ = low.index();
    listed_.resize(high.index() - first_ + 1);
  }

  // Returns false if it was in the set already.
  bool insert(Id id) { return std::exchange(listed_[id.index() - first_], std::uint8_t{1}) == 0; }
  bool contains(Id id) const {
    const std::size_t at = id.index() - first_;  // huge if the id is smaller than the first one
    return at < listed_.size() && listed_[at] != 0;
  }

 private:
  std::size_t first_ = 0;
  std::vector<std::uint8_t> listed_;
};

}  // namespace bslam
