// The patches of the keypoints of one camera, of which some may be absent.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "base/shared_array.h"

namespace bslam::feature {

// Upright window of the level on which a keypoint was detected, centred on its sub-pixel position; it is used for
// sub-pixel alignment after the image was released. Row-major, kPatchSize x kPatchSize grey values at offsets
// -kPatchSize/2 + 0.5 ... in pixels of the level, so that the keypoint lies between the four middle samples.
constexpr int kPatchSize = 10;  // 8 x 8 plus a border of one for gradients
using Patch = std::array<std::uint8_t, kPatchSize * kPatchSize>;

// Immutable; copies share the patches. The patches that are present follow each other in order of keypoint; unless all
// are, a bit per keypoint shows whether its patch is present.
class Patches {
 public:
  Patches() = default;
  Patches(std::vector<Patch>&& all)  // NOLINT(google-explicit-constructor): a vector can be moved into it
      : patches_(std::move(all)), size_(patches_.size()) {}
  // Bit k % 64 of present[k / 64] is set if keypoint k has a patch; no bits beyond `keypoints` are set, and `patches`
  // has as many elements as bits are set.
  Patches(SharedArray<Patch> patches, SharedArray<std::uint64_t> present, std::size_t keypoints);

  std::size_t size() const { return size_; }  // number of keypoints
  bool complete() const { return patches_.size() == size_; }
  // Null if the keypoint has no patch.
  const Patch* find(std::size_t k) const {
    if (complete()) return &patches_[k];
    const std::uint64_t word = present_[k / 64], bit = std::uint64_t{1} << (k % 64);
    if ((word & bit) == 0) return nullptr;
    return &patches_[before_[k / 64] + static_cast<std::size_t>(std::popcount(word & (bit - 1)))];
  }
  // The keypoint must have a patch.
  const Patch& operator[](std::size_t k) const { return *find(k); }
  // A copy with those of the patches whose keypoints have a value other than 0 in `wanted`.
  Patches only(std::span<const std::uint8_t> wanted) const;

  // The patches that are present, and the bits; there are no bits if all are present.
  const SharedArray<Patch>& patches() const { return patches_; }
  const SharedArray<std::uint64_t>& present() const { return present_; }

  std::size_t memory_bytes(MemoryCount& count) const {
    return patches_.memory_bytes(count) + present_.memory_bytes(count) + before_.memory_bytes(count);
  }
  friend bool operator==(const Patches& a, const Patches& b) {
    return a.size_ == b.size_ && a.present_ == b.present_ && a.patches_ == b.patches_;
  }

 private:
  SharedArray<Patch> patches_;
  SharedArray<std::uint64_t> present_;  // empty if complete
  SharedArray<std::uint32_t> before_;   // number of patches before each word of present_
  std::size_t size_ = 0;
};

}  // namespace bslam::feature
