// The observations of all landmarks: one list each, shared between versions of the map in blocks.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "map/cow_vector.h"
#include "map/landmark.h"

namespace bslam::map {

// Lists are in order of keyframe. Those of kBlock neighbouring landmarks lie in one array (compressed rows), so that
// detaching a block costs one allocation and not one per landmark. `tag` as in CowVector.
class ObservationColumn {
 public:
  // Valid until the next change.
  std::span<const Observation> operator[](std::size_t landmark) const {
    const Block& block = blocks_[landmark / kBlock];
    const std::size_t row = landmark % kBlock;
    return {block.entries.data() + block.begin[row], block.entries.data() + block.begin[row + 1]};
  }

  // Appends a landmark without observations.
  void push_back(std::uint64_t tag);
  // The landmark has no observation of that keyframe yet.
  void insert(std::size_t landmark, Observation o, std::uint64_t tag);
  // The landmark has this observation.
  void erase(std::size_t landmark, Observation o, std::uint64_t tag);

  static constexpr std::size_t kBlock = 16;
  // Gives up the memory of a full block of landmarks without observations.
  void blank_block(std::size_t block, std::uint64_t tag) { blocks_.blank_chunk(block, tag); }

 private:
  struct Block {
    std::array<std::uint32_t, kBlock + 1> begin{};  // into entries
    std::vector<Observation> entries;
  };
  CowVector<Block, 1> blocks_;
  std::size_t size_ = 0;
};

}  // namespace bslam::map
