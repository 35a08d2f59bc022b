// The rebase rules for poses and corrections.
#include <gtest/gtest.h>

#include "map/rebase.h"
#include "rebase_fixture.h"

namespace bslam::map {
namespace {

using geometry::SE3;

TEST_F(RebaseTest, PosesOfRemovedKeyframesAndLandmarksAreIgnored) {
  const Eigen::Vector3d position = store.snapshot()->landmark(LandmarkId(1)).position;
  early->remove_keyframe(kThird);
  early->remove_landmark(LandmarkId(0));
  early->merge_landmarks(LandmarkId(2), LandmarkId(1));
  const SE3 pose = random_pose(random, 1);
  late->set_poses({{{kSecond, pose}, {kThird, pose}}, {{LandmarkId(0), {1, 2, 3}}, {LandmarkId(2), {1, 2, 3}}}});
  const CommitReport report = commit();
  expect_near(report.published->keyframe(kSecond).T_rig_world, pose);
  EXPECT_EQ(report.published->landmark(LandmarkId(1)).position, position);
  EXPECT_EQ(report.applied, 1u);
}

TEST_F(RebaseTest, NewerKeyframesAndLandmarksMoveWithPoses) {
  const KeyframeId child = add_keyframe(*early, {}, kThird);
  const KeyframeId grandchild = add_keyframe(*early, {}, child);
  const KeyframeId elsewhere = add_keyframe(*early, {}, kRoot);
  const LandmarkId by_third = early->add_landmark(random_point(random), {{kThird, FeatureId(40)}});
  const LandmarkId by_grandchild = early->add_landmark(random_point(random), {{grandchild, FeatureId(1)}});
  const LandmarkId by_elsewhere = early->add_landmark(random_point(random), {{elsewhere, FeatureId(1)}});
  const BundledMap before = early->map();
  const SE3 T_third_new = random_pose(random, 1);
  late->set_poses({{{kThird, T_third_new}}, {}});
  const MapSnapshot after = commit().published;

  const auto relative = [](const BundledMap& map, KeyframeId a, KeyframeId b) {
    return map.keyframe(a).T_rig_world * map.keyframe(b).T_rig_world.inverse();
  };
  expect_near(after->keyframe(kThird).T_rig_world, T_third_new);
  expect_near(relative(*after, child, kThird), relative(before, child, kThird));
  expect_near(relative(*after, grandchild, child), relative(before, grandchild, child));
  const auto in_keyframe = [](const BundledMap& map, LandmarkId l) -> Eigen::Vector3d {
    return map.keyframe(map.landmark(l).reference.keyframe).T_rig_world * map.landmark(l).position;
  };
  EXPECT_LT((in_keyframe(*after, by_third) - in_keyframe(before, by_third)).norm(), 1e-10);
  EXPECT_LT((in_keyframe(*after, by_grandchild) - in_keyframe(before, by_grandchild)).norm(), 1e-10);
  EXPECT_EQ(after->keyframe(elsewhere).T_rig_world.translation(), before.keyframe(elsewhere).T_rig_world.translation());
  EXPECT_EQ(after->landmark(by_elsewhere).position, before.landmark(by_elsewhere).position);
  EXPECT_EQ(after->landmark(LandmarkId(0)).position, before.landmark(LandmarkId(0)).position);
}

TEST_F(RebaseTest, PosesAreDroppedAfterACorrection) {
  const SE3 corrected = random_pose(random, 1);
  early->set_poses({{{kThird, corrected}}, {}, true});
  const LandmarkId l = late->add_landmark(random_point(random), {{kSecond, FeatureId(40)}});
  late->set_poses({{{kSecond, random_pose(random, 1)}, {kThird, random_pose(random, 1)}}, {{l, {1, 2, 3}}}});
  late->add_visibility_counts({{LandmarkId(0), 1, 1}});
  const MapSnapshot before = store.snapshot();
  const CommitReport report = commit();
  expect_near(report.published->keyframe(kThird).T_rig_world, corrected);
  expect_near(report.published->keyframe(kSecond).T_rig_world, before->keyframe(kSecond).T_rig_world);
  EXPECT_NE(report.published->landmark(report.landmarks.at(0)).position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(report.dropped, 1u);  // the rest of the edit is applied
  EXPECT_EQ(report.applied, 2u);
  EXPECT_EQ(report.published->gauge_epoch(), before->gauge_epoch() + 1);
}

TEST_F(RebaseTest, UncertaintiesAreSetAndDroppedWithThePoses) {
  const geometry::Matrix6d own = geometry::Matrix6d::Identity(), theirs = 2 * own;
  const KeyframeId newer = add_keyframe(*early, same_numbers(0, 5));
  early->remove_keyframe(kThird);
  const KeyframeId added = add_keyframe(*late, same_numbers(0, 5));
  const SE3 pose = random_pose(random, 1);
  late->set_poses({.keyframes = {{kSecond, pose}, {kThird, pose}, {added, pose}},
                   .landmarks = {},
                   .uncertainties = {{kSecond, {own}}, {kThird, {own}}, {added, {theirs}}}});
  EXPECT_EQ(late->map().keyframe(added).uncertainty.noise, theirs);
  const CommitReport report = commit();
  EXPECT_EQ(report.published->keyframe(kSecond).uncertainty.noise, own);
  EXPECT_EQ(report.published->keyframe(report.keyframes.at(0)).uncertainty.noise, theirs);
  EXPECT_EQ(report.published->keyframe(newer).uncertainty.noise, geometry::Matrix6d::Zero());

  early.emplace(store.snapshot());
  late.emplace(store.snapshot());
  early->set_poses({{{kSecond, random_pose(random, 1)}}, {}, true});
  late->set_poses({.keyframes = {{kSecond, pose}}, .landmarks = {}, .uncertainties = {{kSecond, {theirs}}}});
  EXPECT_EQ(commit().published->keyframe(kSecond).uncertainty.noise, own);
}

TEST_F(RebaseTest, TheSecondOfTwoConcurrentCorrectionsIsRejected) {
  const SE3 corrected = random_pose(random, 1);
  early->set_poses({{{kThird, corrected}}, {}, true});
  late->set_poses({{{kThird, random_pose(random, 1)}}, {}, true});
  ASSERT_TRUE(late->merge_landmarks(LandmarkId(0), LandmarkId(1)));
  const CommitReport report = commit();
  EXPECT_TRUE(report.rejected);
  EXPECT_EQ(report.published, store.snapshot());
  EXPECT_TRUE(report.published->alive(LandmarkId(0)));
  expect_near(report.published->keyframe(kThird).T_rig_world, corrected);
  EXPECT_EQ(report.published->gauge_epoch(), 1);
}

TEST_F(RebaseTest, ACorrectionBeginsAnEpochWhenRebased) {
  early->set_poses({{{kSecond, random_pose(random, 1)}}, {}});
  const KeyframeId child = add_keyframe(*early, {}, kThird);
  const SE3 T_child_third =
      early->map().keyframe(child).T_rig_world * early->map().keyframe(kThird).T_rig_world.inverse();
  const SE3 corrected = random_pose(random, 1);
  late->set_poses({{{kThird, corrected}}, {}, true});
  // an edit's own correction does not cause its later poses to be dropped
  late->set_poses({{{kSecond, corrected}}, {}});
  const CommitReport report = commit();
  EXPECT_EQ(report.dropped, 0u);
  EXPECT_EQ(report.published->gauge_epoch(), 1);
  expect_near(report.published->keyframe(kThird).T_rig_world, corrected);
  expect_near(report.published->keyframe(kSecond).T_rig_world, corrected);
  expect_near(report.published->keyframe(child).T_rig_world, T_child_third * corrected);
}

TEST_F(RebaseTest, ACorrectionOfRemovedKeyframesBeginsNoEpoch) {
  early->remove_keyframe(kThird);
  late->set_poses({{{kThird, random_pose(random, 1)}}, {}, true});
  const CommitReport report = commit();
  EXPECT_EQ(report.dropped, 1u);
  EXPECT_EQ(report.published->gauge_epoch(), 0);
}

TEST_F(RebaseTest, PosesWithoutACorrectionStayInTheEpoch) {
  early->set_poses({{{kThird, random_pose(random, 1)}}, {}});
  const SE3 pose = random_pose(random, 1);
  late->set_poses({{{kThird, pose}}, {}});
  const CommitReport report = commit();
  expect_near(report.published->keyframe(kThird).T_rig_world, pose);
  EXPECT_EQ(report.published->gauge_epoch(), 0);
}

TEST_F(RebaseTest, PosesOfTheEditsOwnAdditionsFollowTheirIds) {
  add_keyframe(*early, same_numbers(0, 3));
  early->add_landmark(random_point(random), {{kRoot, FeatureId(40)}});
  const KeyframeId k = add_keyframe(*late, same_numbers(0, 3));
  const LandmarkId l = late->add_landmark(random_point(random), {{k, FeatureId(40)}});
  const SE3 pose = random_pose(random, 1);
  late->set_poses({{{k, pose}}, {{l, {1, 2, 3}}}});
  const SE3 T_early_world = early->map().keyframe(k).T_rig_world;  // the same provisional id
  const CommitReport report = commit();
  expect_near(report.published->keyframe(report.keyframes.at(0)).T_rig_world, pose);
  EXPECT_EQ(report.published->landmark(report.landmarks.at(0)).position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(report.published->keyframe(k).T_rig_world.translation(), T_early_world.translation());
}

}  // namespace
}  // namespace bslam::map
