// The memory of a map is that of its containers, each shared piece counted once.
#include <gtest/gtest.h>

#include "map/bundled_map.h"
#include "map/synthetic_map.h"

namespace bslam::map {
namespace {

constexpr std::size_t kKeypoints = 200, kCameras = 2;

// Adds a keyframe that observes `landmarks` new landmarks.
void add_keyframe(BundledMap& map, Random& random, std::size_t landmarks) {
  const auto frame = synthetic_frame(random, kCameras, kKeypoints, 50);
  const KeyframeId k = map.add_keyframe(frame, random_pose(random, 0.1), {}, map.newest_keyframe());
  for (std::size_t l = 0; l < landmarks; ++l) {
    const Observation seen{k, FeatureId(l)};
    map.add_landmark(random_point(random), std::span(&seen, 1));
  }
}

std::size_t total(const BundledMap& map) {
  MemoryCount count;
  return map.memory(count).total();
}

TEST(MapMemory, GrowsWithTheKeyframesByAtLeastTheirKeypoints) {
  Random random(3);
  BundledMap map(synthetic_rig(kCameras));
  MemoryCount first;
  EXPECT_EQ(map.memory(first).descriptors, 0u);
  std::size_t before = total(map);
  for (int i = 0; i < 40; ++i) {
    add_keyframe(map, random, 20);
    const std::size_t now = total(map);
    EXPECT_GE(now - before, kCameras * kKeypoints * (sizeof(feature::Descriptor) + sizeof(feature::Patch)));
    before = now;
  }
  MemoryCount count;
  const MapMemory memory = map.memory(count);
  const std::size_t keypoints = 40 * kCameras * kKeypoints;
  EXPECT_GE(memory.descriptors, keypoints * sizeof(feature::Descriptor));
  EXPECT_LE(memory.descriptors, keypoints * sizeof(feature::Descriptor) + 40 * kCameras * 64);
  EXPECT_GE(memory.patches, keypoints * sizeof(feature::Patch));
  EXPECT_GE(memory.features, keypoints * (sizeof(Eigen::Vector2f) + sizeof(Eigen::Vector3d)));
  EXPECT_GE(memory.landmarks, 800 * sizeof(Landmark));
  EXPECT_GE(memory.observations, 800 * sizeof(Observation));
}

TEST(MapMemory, CountsWhatVersionsShareOnce) {
  Random random(4);
  BundledMap map(synthetic_rig(kCameras));
  for (int i = 0; i < 20; ++i) add_keyframe(map, random, 20);
  BundledMap copy = map;
  MemoryCount count;
  const std::size_t whole = map.memory(count).total();
  EXPECT_LT(copy.memory(count).total(), whole / 100);  // the top level of its tables
  copy.set_pose(KeyframeId(3), random_pose(random, 0.1));
  EXPECT_LT(copy.memory(count).total(), whole / 20);
  add_keyframe(copy, random, 20);
  EXPECT_GT(copy.memory(count).descriptors, 0u);
  EXPECT_EQ(total(map), whole);
}

}  // namespace
}  // namespace bslam::map
