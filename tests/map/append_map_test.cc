#include "map/append_map.h"

#include <gtest/gtest.h>

#include "synthetic_map.h"

namespace bslam::map {
namespace {

// A map with several submaps, from which keyframes and landmarks were removed.
BundledMap worn_map(std::uint64_t seed) {
  MapStore store{BundledMap(synthetic_rig(2))};
  RandomEditor editor(seed);
  for (int batch = 0; batch < 8; ++batch) {
    MapDraft draft(store.snapshot());
    for (int i = 0; i < 40; ++i) editor.change(draft);
    store.commit(std::move(draft));
  }
  BundledMap map = *store.snapshot();
  Random random(seed, "another part");
  const KeyframeId root = map.add_keyframe(synthetic_frame(random, 2, 20, 5), random_pose(random, 1), {}, {});
  map.add_keyframe(synthetic_frame(random, 2, 20, 5), random_pose(random, 1), {}, root);
  for (const LandmarkId l : map.landmark_ids()) map.refresh_landmark(l);
  return map;
}

TEST(AppendMap, KeepsPosesTreesAndObservations) {
  const BundledMap first = worn_map(11);
  BundledMap other = worn_map(12);
  for (const KeyframeId k : other.keyframe_ids())
    other.set_uncertainty(k, {static_cast<double>(k.index()) * geometry::Matrix6d::Identity()});
  ASSERT_GT(other.roots().size(), 1u);
  ASSERT_GT(other.keyframe_slots(), other.num_keyframes());
  BundledMap map = first;
  const AppendedIds ids = append_map(map, other);
  EXPECT_EQ(map.check_invariants().value_or("valid"), "valid");
  EXPECT_EQ(map.num_keyframes(), first.num_keyframes() + other.num_keyframes());
  EXPECT_EQ(map.num_landmarks(), first.num_landmarks() + other.num_landmarks());
  EXPECT_EQ(map.num_observations(), first.num_observations() + other.num_observations());
  EXPECT_EQ(map.roots().size(), first.roots().size() + other.roots().size());
  for (std::size_t i = 0; i < other.keyframe_slots(); ++i) {
    const BundledKeyframe& source = other.keyframe(KeyframeId(i));
    ASSERT_EQ(ids.keyframes[i].valid(), source.alive);
    if (!source.alive) continue;
    const BundledKeyframe& added = map.keyframe(ids.keyframes[i]);
    EXPECT_EQ(added.frame, source.frame);
    EXPECT_EQ(added.T_rig_world.rotation().coeffs(), source.T_rig_world.rotation().coeffs());
    EXPECT_EQ(added.T_rig_world.translation(), source.T_rig_world.translation());
    EXPECT_EQ(added.uncertainty.noise, source.uncertainty.noise);
    EXPECT_EQ(added.parent, source.parent.valid() ? ids.keyframes[source.parent.index()] : KeyframeId());
  }
}

TEST(AppendMap, KeepsTheDataOfLandmarks) {
  const BundledMap first = worn_map(13), other = worn_map(14);
  BundledMap map = first;
  const AppendedIds ids = append_map(map, other);
  for (std::size_t i = 0; i < other.landmark_slots(); ++i) {
    const Landmark& source = other.landmark(LandmarkId(i));
    ASSERT_EQ(ids.landmarks[i].valid(), source.alive);
    if (!source.alive) continue;
    const Landmark& added = map.landmark(ids.landmarks[i]);
    EXPECT_EQ(added.position, source.position);
    EXPECT_EQ(added.view_direction, source.view_direction);
    EXPECT_EQ(added.max_distance, source.max_distance);
    EXPECT_EQ(added.descriptor, source.descriptor);
    EXPECT_EQ(added.reference.keypoint, source.reference.keypoint);
    EXPECT_EQ(added.reference.keyframe, ids.keyframes[source.reference.keyframe.index()]);
    EXPECT_EQ(added.expected, source.expected);
    EXPECT_EQ(added.found, source.found);
    if (other.alive(source.born)) {
      EXPECT_EQ(added.born, ids.keyframes[source.born.index()]);
    }
    const auto a = map.observations(ids.landmarks[i]), b = other.observations(LandmarkId(i));
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t n = 0; n < a.size(); ++n) {
      EXPECT_EQ(a[n], (Observation{ids.keyframes[b[n].keyframe.index()], b[n].feature, b[n].aligned}));
    }
  }
}

TEST(AppendMap, DoesNotChangeTheExistingSubmaps) {
  const BundledMap first = worn_map(15), other = worn_map(16);
  BundledMap map = first;
  const AppendedIds ids = append_map(map, other);
  for (const KeyframeId root : other.roots()) EXPECT_TRUE(map.remove_submap(ids.keyframes[root.index()]));
  EXPECT_EQ(map.keyframe_ids(), first.keyframe_ids());
  EXPECT_EQ(map.landmark_ids(), first.landmark_ids());
  EXPECT_EQ(map.roots(), first.roots());
  EXPECT_EQ(map.num_observations(), first.num_observations());
}

TEST(AttachKeyframes, RejectsACycle) {
  Random random(1);
  BundledMap map{synthetic_rig(1)};
  for (int i = 0; i < 4; ++i) map.add_keyframe(synthetic_frame(random, 1, 5, 0), {}, {}, {});
  const std::vector<KeyframeId> circle = {KeyframeId(), KeyframeId(2), KeyframeId(3), KeyframeId(1)};
  EXPECT_FALSE(attach_keyframes(map, KeyframeId(0), circle));
  const std::vector<KeyframeId> itself = {KeyframeId(0), KeyframeId(), KeyframeId(), KeyframeId()};
  EXPECT_FALSE(attach_keyframes(map, KeyframeId(0), itself));
}

}  // namespace
}  // namespace bslam::map
