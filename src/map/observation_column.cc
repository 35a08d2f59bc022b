#include "map/observation_column.h"

#include <algorithm>

#include "base/assert.h"

namespace bslam::map {

void ObservationColumn::push_back(std::uint64_t tag) {
  if (size_ % kBlock == 0) blocks_.push_back({}, tag);
  ++size_;
}

void ObservationColumn::append(std::span<const std::uint32_t> counts, std::span<const Observation> observations,
                               std::uint64_t tag) {
  BSLAM_ASSERT(size_ % kBlock == 0 && counts.size() <= kBlock,
               "the last block must be full before another one is appended");
  Block block;
  for (std::size_t r = 0; r < kBlock; ++r) block.begin[r + 1] = block.begin[r] + (r < counts.size() ? counts[r] : 0);
  block.entries.assign(observations.begin(), observations.end());
  blocks_.push_back(std::move(block), tag);
  size_ += counts.size();
}

void ObservationColumn::insert(std::size_t landmark, Observation o, std::uint64_t tag) {
  Block& block = blocks_.mutate(landmark / kBlock, tag);
  const std::size_t row = landmark % kBlock;
  const auto first = block.entries.begin() + block.begin[row], last = block.entries.begin() + block.begin[row + 1];
  block.entries.insert(std::lower_bound(first, last, o), o);
  for (std::size_t r = row + 1; r <= kBlock; ++r) ++block.begin[r];
}

void ObservationColumn::erase(std::size_t landmark, Observation o, std::uint64_t tag) {
  Block& block = blocks_.mutate(landmark / kBlock, tag);
  const std::size_t row = landmark % kBlock;
  const auto first = block.entries.begin() + block.begin[row], last = block.entries.begin() + block.begin[row + 1];
  const auto at = std::lower_bound(first, last, o);
  BSLAM_ASSERT(at != last && *at == o, "the erased observation must exist");
  block.entries.erase(at);
  for (std::size_t r = row + 1; r <= kBlock; ++r) --block.begin[r];
}

}  // namespace bslam::map
