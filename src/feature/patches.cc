#include "feature/patches.h"

#include <utility>

#include "base/assert.h"

namespace bslam::feature {

Patches::Patches(SharedArray<Patch> patches, SharedArray<std::uint64_t> present, std::size_t keypoints)
    : patches_(std::move(patches)), size_(keypoints) {
  if (complete()) return;
  present_ = std::move(present);
  std::vector<std::uint32_t> before(present_.size());
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    before[i] = count;
    count += static_cast<std::uint32_t>(std::popcount(present_[i]));
  }
  BSLAM_ASSERT(count == patches_.size(), "there must be as many patches as bits");
  before_ = std::move(before);
}

Patches Patches::only(std::span<const std::uint8_t> wanted) const {
  std::vector<std::uint64_t> present((size_ + 63) / 64, 0);
  std::vector<Patch> kept;
  for (std::size_t k = 0; k < size_; ++k) {
    const Patch* const patch = wanted[k] != 0 ? find(k) : nullptr;
    if (patch == nullptr) continue;
    present[k / 64] |= std::uint64_t{1} << (k % 64);
    kept.push_back(*patch);
  }
  if (kept.size() == patches_.size()) return *this;
  return {std::move(kept), std::move(present), size_};
}

}  // namespace bslam::feature
