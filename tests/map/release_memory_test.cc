// What keyframes lose once they are not new any more.
#include <gtest/gtest.h>

#include "synthetic_map.h"

namespace bslam::map {
namespace {

constexpr std::size_t kKeypoints = 30, kMatched = 10, kLandmarks = 6;

// Every keyframe observes the first landmarks with its first features, which have keypoints in two cameras.
BundledMap map_of(std::size_t keyframes) {
  Random random(1, "release");
  BundledMap map(synthetic_rig(2));
  std::vector<std::pair<FeatureId, LandmarkId>> matches;
  for (std::size_t i = 0; i < keyframes; ++i) {
    const KeyframeId k = map.add_keyframe(synthetic_frame(random, 2, kKeypoints, kMatched), random_pose(random, 0.1),
                                          matches, map.newest_keyframe());
    for (std::size_t f = matches.size(); f < kLandmarks; ++f) {
      const std::vector<Observation> first = {{k, FeatureId(f)}};
      matches.emplace_back(FeatureId(f), map.add_landmark(random_point(random), first));
    }
  }
  return map;
}

std::size_t patches_of(const BundledMap& map, KeyframeId k) {
  std::size_t count = 0;
  for (std::size_t c = 0; c < map.rig().size(); ++c) count += map.keypoints(k, CameraIndex(c)).patch.patches().size();
  return count;
}

TEST(ReleaseUnused, KeepsPatchesThatAreOrCanBecomeReferences) {
  BundledMap map = map_of(BundledMap::kNewKeyframes + 5);
  const BundledMap before = map;
  map.release_unused(1000);
  EXPECT_EQ(map.check_invariants(), std::nullopt);
  for (std::size_t i = 0; i < map.keyframe_slots(); ++i) {
    const KeyframeId k(i);
    const bool released = i < 5;
    EXPECT_EQ(patches_of(map, k), released ? kLandmarks : 2 * kKeypoints) << i;
    EXPECT_EQ(patches_of(before, k), 2 * kKeypoints);
    for (std::size_t f = 0; f < kLandmarks; ++f) {
      const frame::KeypointRef r = map.keyframe(k).frame->bundled.keypoints(FeatureId(f)).front();
      const feature::Patches &now = map.keypoints(k, r.camera).patch, &then = before.keypoints(k, r.camera).patch;
      ASSERT_NE(now.find(r.keypoint.index()), nullptr);
      EXPECT_EQ(now[r.keypoint.index()], then[r.keypoint.index()]);
    }
    EXPECT_EQ(map.keypoints(k, CameraIndex(1)).pixel.data(), before.keypoints(k, CameraIndex(1)).pixel.data());
  }
}

TEST(ReleaseUnused, KeepsAReferenceThatIsNotTheFirstKeypointOfItsFeature) {
  BundledMap map = map_of(3);
  const frame::KeypointRef second = map.keyframe(KeyframeId(1)).frame->bundled.keypoints(FeatureId(8))[1];
  const std::vector<Observation> observations = {{KeyframeId(1), FeatureId(8)}};
  const LandmarkId l = map.add_landmark({0, 0, 5}, observations, {KeyframeId(1), second});
  Random random(3, "more");
  for (std::size_t i = 0; i < BundledMap::kNewKeyframes; ++i)
    map.add_keyframe(synthetic_frame(random, 2, 5, 1), random_pose(random, 0.1), {}, KeyframeId(0));
  map.release_unused(1000);
  EXPECT_EQ(map.landmark(l).reference.keypoint, second);
  EXPECT_NE(map.keypoints(KeyframeId(1), second.camera).patch.find(second.keypoint.index()), nullptr);
  EXPECT_EQ(patches_of(map, KeyframeId(1)), kLandmarks + 2);
}

TEST(ReleaseUnused, VisitsAFewKeyframesAtATime) {
  BundledMap map = map_of(BundledMap::kNewKeyframes + 5);
  map.release_unused(2);
  EXPECT_LT(patches_of(map, KeyframeId(1)), 2 * kKeypoints);
  EXPECT_EQ(patches_of(map, KeyframeId(2)), 2 * kKeypoints);
  map.release_unused(2);
  EXPECT_LT(patches_of(map, KeyframeId(3)), 2 * kKeypoints);
}

TEST(ReleaseUnused, ARemovedReferenceIsReplacedByAKeypointWithAPatch) {
  BundledMap map = map_of(BundledMap::kNewKeyframes + 5);
  map.release_unused(1000);
  // The landmark gets observations by features that have lost their patches, and one in a new keyframe.
  const KeyframeId newest = map.newest_keyframe();
  const std::vector<Observation> first = {{newest, FeatureId(9)}};
  const LandmarkId l = map.add_landmark({0, 0, 5}, first);
  for (std::size_t k = 1; k < 4; ++k) ASSERT_TRUE(map.add_observation(l, {KeyframeId(k), FeatureId(9)}));
  const KeyframeId recent(newest.index() - 1);
  ASSERT_TRUE(map.add_observation(l, {recent, FeatureId(9)}));
  ASSERT_TRUE(map.remove_observation(l, newest));
  EXPECT_EQ(map.landmark(l).reference.keyframe, recent);
  ASSERT_TRUE(map.remove_observation(l, recent));
  EXPECT_EQ(map.landmark(l).reference.keyframe, KeyframeId(1));  // the oldest, for want of one with a patch
  EXPECT_EQ(map.check_invariants(), std::nullopt);
}

}  // namespace
}  // namespace bslam::map
