// The observation lists of all landmarks, shared between map versions in blocks.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "map/cow_vector.h"
#include "map/landmark.h"

namespace bslam::map {

// Each list is ordered by keyframe. The lists of kBlock neighbouring landmarks are stored in one array (compressed
// rows), so that detaching a block costs one allocation instead of one per landmark. `tag` is as in CowVector.
class ObservationColumn {
 public:
  // The span is valid until the next change.
  std::span<const Observation> operator[](std::size_t landmark) const {
    const Block& block = blocks_[landmark / kBlock];
    const std::size_t row = landmark % kBlock;
    return {block.entries.data() + block.begin[row], block.entries.data() + block.begin[row + 1]};
  }

  // Appends a landmark without observations.
  void push_back(std::uint64_t tag);
  // Appends up to kBlock landmarks with these numbers of observations, which follow each other in `observations`. The
  // last block must be full.
  void append(std::span<const std::uint32_t> counts, std::span<const Observation> observations, std::uint64_t tag);
  // The landmark must not have an observation by that keyframe yet.
  void insert(std::size_t landmark, Observation o, std::uint64_t tag);
  // The landmark must have this observation.
  void erase(std::size_t landmark, Observation o, std::uint64_t tag);

  static constexpr std::size_t kBlock = 16;
  // Releases the memory of a full block of landmarks without observations.
  void blank_block(std::size_t block, std::uint64_t tag) { blocks_.blank_chunk(block, tag); }

  // The memory of the blocks that were not counted before.
  std::size_t memory_bytes(MemoryCount& count) const {
    return blocks_.memory_bytes(count, [](const Block& block) { return bslam::memory_bytes(block.entries); });
  }

 private:
  struct Block {
    std::array<std::uint32_t, kBlock + 1> begin{};  // indices into entries
    std::vector<Observation> entries;
  };
  CowVector<Block, 1> blocks_;
  std::size_t size_ = 0;
};

}  // namespace bslam::map
