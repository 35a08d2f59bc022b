#include "feature/keypoints.h"

#include <utility>

#include "base/assert.h"

namespace bslam::feature {

void Detections::clear() {
  pixel.clear();
  level.clear();
  angle.clear();
  sigma.clear();
  bearing.clear();
  descriptor.clear();
  patch.clear();
}

void Detections::reserve(std::size_t n) {
  pixel.reserve(n);
  level.reserve(n);
  angle.reserve(n);
  sigma.reserve(n);
  bearing.reserve(n);
  descriptor.reserve(n);
  patch.reserve(n);
}

Keypoints::Keypoints(Detections&& detected)
    : level(std::move(detected.level)),
      angle(std::move(detected.angle)),
      descriptor(std::move(detected.descriptor)),
      pixel(std::move(detected.pixel)),
      bearing(std::move(detected.bearing)),
      sigma(std::move(detected.sigma)),
      patch(std::move(detected.patch)) {}

Keypoints Keypoints::refined(Refinement&& refinement) const {
  BSLAM_ASSERT(
      refinement.pixel.size() == size() && refinement.bearing.size() == size() && refinement.sigma.size() == size(),
      "a refinement must have a position for every keypoint");
  Keypoints out = *this;
  out.pixel = std::move(refinement.pixel);
  out.bearing = std::move(refinement.bearing);
  out.sigma = std::move(refinement.sigma);
  return out;
}

KeypointMemory Keypoints::memory(MemoryCount& count) const {
  return {.positions = level.memory_bytes(count) + angle.memory_bytes(count) + pixel.memory_bytes(count) +
                       bearing.memory_bytes(count) + sigma.memory_bytes(count),
          .descriptors = descriptor.memory_bytes(count),
          .patches = patch.memory_bytes(count)};
}

}  // namespace bslam::feature
