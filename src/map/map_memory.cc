// The memory of a map, each shared piece counted once.
#include "map/bundled_map.h"

namespace bslam::map {
namespace {

void add_frame(const frame::BundledFrame& frame, MemoryCount& count, MapMemory& memory) {
  const std::size_t own = count.once(&frame, sizeof(frame) + MemoryCount::kShared + bslam::memory_bytes(frame.cameras));
  if (own == 0) return;
  memory.features += own + frame.bundled.memory_bytes(count);
  for (const frame::CameraFrame& c : frame.cameras) {
    const feature::KeypointMemory keypoints = c.keypoints.memory(count);
    memory.features += keypoints.positions + c.grid.memory_bytes(count);
    memory.descriptors += keypoints.descriptors;
    memory.patches += keypoints.patches;
    memory.words += c.words.memory_bytes(count);
  }
}

}  // namespace

MapMemory BundledMap::memory(MemoryCount& count) const {
  const auto nothing = [](const auto&) { return std::size_t{0}; };
  MapMemory memory;
  memory.keyframes = keyframes_.memory_bytes(count, [&](const BundledKeyframe& k) {
    if (k.frame) add_frame(*k.frame, count, memory);
    memory.covisibility += k.covisible.memory_bytes(count);
    return k.landmarks.memory_bytes(count) + bslam::memory_bytes(k.children);
  });
  memory.landmarks = landmarks_.memory_bytes(count, nothing) + merged_into_.memory_bytes(count, nothing);
  memory.observations = observations_.memory_bytes(count);
  return memory;
}

}  // namespace bslam::map
