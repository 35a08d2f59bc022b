#include "map/anchored_pose.h"

#include <gtest/gtest.h>

#include "map/synthetic_map.h"

namespace bslam::map {
namespace {

using geometry::SE3;

double difference(const SE3& a, const SE3& b) { return (a * b.inverse()).log().norm(); }

// A chain of three keyframes, and a pose near the last one.
struct Scene {
  Scene() {
    KeyframeId last;
    for (int i = 0; i < 3; ++i) {
      last = map.add_keyframe(synthetic_frame(random, 2, 30, 10), random_pose(random, 0.2), {}, last);
      keyframes.push_back(last);
    }
    T_rig_world = random_pose(random, 0.2);
    anchored = AnchoredPose::at(map, keyframes.back(), T_rig_world);
  }
  Random random{7};
  BundledMap map{synthetic_rig(2)};
  std::vector<KeyframeId> keyframes;
  SE3 T_rig_world;
  AnchoredPose anchored;
};

TEST(AnchoredPose, ResolvesToTheOriginalPose) {
  const Scene scene;
  ASSERT_TRUE(scene.anchored.known_in(scene.map));
  EXPECT_LT(difference(*scene.anchored.resolve(scene.map), scene.T_rig_world), 1e-12);
}

TEST(AnchoredPose, FollowsItsKeyframe) {
  Scene scene;
  const SE3 T_last_world = scene.map.keyframe(scene.keyframes.back()).T_rig_world;
  const SE3 T_moved_world = random_pose(scene.random, 0.5);
  scene.map.set_pose(scene.keyframes.back(), T_moved_world);
  EXPECT_LT(difference(*scene.anchored.resolve(scene.map), scene.T_rig_world * T_last_world.inverse() * T_moved_world),
            1e-12);
}

TEST(AnchoredPose, SurvivesRemovalOfItsKeyframeButNotOfItsSubmap) {
  Scene scene;
  ASSERT_TRUE(scene.map.remove_keyframe(scene.keyframes.back()));
  EXPECT_LT(difference(*scene.anchored.resolve(scene.map), scene.T_rig_world), 1e-12);
  ASSERT_TRUE(scene.map.remove_submap(scene.keyframes.front()));
  EXPECT_FALSE(scene.anchored.known_in(scene.map));
  EXPECT_FALSE(scene.anchored.resolve(scene.map));
}

TEST(AnchoredPose, FollowsTheScaleOfItsSubmap) {
  Scene scene;
  ASSERT_TRUE(scene.map.scale_submap(scene.keyframes.front(), 3.0));
  EXPECT_DOUBLE_EQ(scene.anchored.scale_change(scene.map), 3.0);
  const SE3 expected = geometry::scaled(scene.T_rig_world, 3.0);
  EXPECT_LT(difference(*scene.anchored.resolve(scene.map), expected), 1e-12);
  scene.anchored.rescale(scene.map);
  EXPECT_EQ(scene.anchored.scale_change(scene.map), 1.0);
  EXPECT_LT(difference(*scene.anchored.resolve(scene.map), expected), 1e-12);
  // A pose anchored after a change of scale has the new scale.
  const AnchoredPose later = AnchoredPose::at(scene.map, scene.keyframes.front(), expected);
  EXPECT_LT(difference(*later.resolve(scene.map), expected), 1e-12);
}

TEST(AnchoredPose, HasNoPoseWithoutAReference) {
  const Scene scene;
  const AnchoredPose none;
  EXPECT_FALSE(none.known_in(scene.map));
  EXPECT_FALSE(none.resolve(scene.map));
  EXPECT_EQ(none.scale_change(scene.map), 1.0);
}

}  // namespace
}  // namespace bslam::map
