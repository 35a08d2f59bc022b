// At least one test for every rebase rule of map_edit.h: here for keyframes, landmarks and observations; see also
// rebase_poses_test.cc and rebase_submaps_test.cc.
#include "map/rebase.h"

#include <gtest/gtest.h>

#include "rebase_fixture.h"

namespace bslam::map {
namespace {

using geometry::SE3;

TEST_F(RebaseTest, NewKeyframeForwardsMergedAndDropsRemovedMatches) {
  early->remove_landmark(LandmarkId(0));
  early->merge_landmarks(LandmarkId(1), LandmarkId(11));
  early->merge_landmarks(LandmarkId(2), LandmarkId(3));
  add_keyframe(*late, same_numbers(0, 5));
  const CommitReport report = commit();
  const KeyframeId k = report.keyframes.at(0);
  EXPECT_FALSE(report.published->landmark_of(k, FeatureId(0)).valid());
  EXPECT_EQ(report.published->landmark_of(k, FeatureId(1)), LandmarkId(11));
  EXPECT_EQ(report.published->landmark_of(k, FeatureId(2)), LandmarkId(3));
  EXPECT_FALSE(report.published->landmark_of(k, FeatureId(3)).valid());  // feature 2 already observes landmark 3
  EXPECT_EQ(report.published->landmark_of(k, FeatureId(4)), LandmarkId(4));
}

TEST_F(RebaseTest, NewKeyframeMovesWithItsParent) {
  const SE3 before = store.snapshot()->keyframe(kThird).T_rig_world, after = random_pose(random, 1);
  early->set_poses({{{kThird, after}}, {}});
  const KeyframeId draft_id = add_keyframe(*late, same_numbers(0, 5));
  ASSERT_EQ(late->map().keyframe(draft_id).parent, kThird);
  const SE3 T_kf_parent = late->map().keyframe(draft_id).T_rig_world * before.inverse();
  const CommitReport report = commit();
  expect_near(report.published->keyframe(report.keyframes.at(0)).T_rig_world, T_kf_parent * after);
}

TEST_F(RebaseTest, NewKeyframeFallsBackToAnAliveAncestor) {
  early->remove_keyframe(kThird);
  add_keyframe(*late, {}, kThird);
  const CommitReport report = commit();
  EXPECT_EQ(report.published->keyframe(report.keyframes.at(0)).parent, kSecond);
}

TEST_F(RebaseTest, NewRootKeyframeStartsASubmap) {
  MapDraft setup(store.snapshot());
  setup.remove_keyframe(kThird);
  store.commit(std::move(setup));
  early.emplace(store.snapshot());
  late.emplace(store.snapshot());
  add_keyframe(*early, same_numbers(0, 5));
  const KeyframeId k = add_keyframe(*late, {}, kThird);  // removed before the edit began, so it cannot be the parent
  EXPECT_FALSE(late->map().keyframe(k).parent.valid());
  const CommitReport report = commit();
  EXPECT_FALSE(report.published->keyframe(report.keyframes.at(0)).parent.valid());
}

TEST_F(RebaseTest, NewKeyframeOfARemovedSubmapStartsANewOne) {
  const KeyframeId root = begin_submap();
  early->remove_submap(root);
  add_keyframe(*late, {}, root);
  const CommitReport report = commit();
  EXPECT_EQ(report.published->roots(), (std::vector{kRoot, report.keyframes.at(0)}));
}

TEST_F(RebaseTest, NewKeyframeObservesNewLandmarksOfItsOwnEdit) {
  early->add_landmark(random_point(random), {{kRoot, FeatureId(40)}});
  const LandmarkId draft_id = late->add_landmark(random_point(random), {{kRoot, FeatureId(41)}});
  add_keyframe(*late, {{FeatureId(7), draft_id}});
  const CommitReport report = commit();
  EXPECT_NE(report.landmarks.at(0), draft_id);
  EXPECT_EQ(report.published->landmark_of(report.keyframes.at(0), FeatureId(7)), report.landmarks.at(0));
}

TEST_F(RebaseTest, NewLandmarkLosesObservationsThatAreNoLongerPossible) {
  early->remove_keyframe(kThird);
  early->add_landmark(random_point(random), {{kRoot, FeatureId(40)}});
  const LandmarkReference reference{kRoot,
                                    store.snapshot()->keyframe(kRoot).frame->bundled.keypoints(FeatureId(40))[0]};
  late->add_landmark(random_point(random), {{kRoot, FeatureId(40)}, {kSecond, FeatureId(41)}, {kThird, FeatureId(42)}},
                     reference);
  late->add_landmark(random_point(random), {{kRoot, FeatureId(43)}});
  const CommitReport report = commit();
  const auto list = report.published->observations(report.landmarks.at(0));
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0], (Observation{kSecond, FeatureId(41)}));
  EXPECT_EQ(report.published->landmark(report.landmarks[0]).reference.keyframe, kSecond);
  EXPECT_EQ(report.landmarks.at(1), LandmarkId(32));
}

TEST_F(RebaseTest, NewLandmarkWithoutRemainingObservationsIsDroppedWithAllOperationsOnIt) {
  early->add_landmark(random_point(random), {{kRoot, FeatureId(40)}});
  const LandmarkId lost = late->add_landmark(random_point(random), {{kRoot, FeatureId(40)}});
  late->add_observation(lost, {kSecond, FeatureId(40)});
  late->refresh_landmarks({lost});
  late->merge_landmarks(lost, LandmarkId(5));
  const LandmarkId next = late->add_landmark(random_point(random), {{kRoot, FeatureId(41)}});
  const CommitReport report = commit();
  EXPECT_FALSE(report.landmarks.at(0).valid());
  EXPECT_EQ(report.landmarks.at(1), next);  // equal only because one was dropped and another one was added
  EXPECT_EQ(report.dropped, 4u);
  EXPECT_EQ(report.applied, 1u);
  EXPECT_FALSE(report.published->landmark_of(kSecond, FeatureId(40)).valid());
}

TEST_F(RebaseTest, NewLandmarkMovesWithTheKeyframeOfItsReference) {
  const SE3 before = store.snapshot()->keyframe(kSecond).T_rig_world, after = random_pose(random, 1);
  early->set_poses({{{kSecond, after}}, {}});
  const Eigen::Vector3d position = random_point(random);
  late->add_landmark(position, {{kSecond, FeatureId(40)}});
  const CommitReport report = commit();
  const Eigen::Vector3d moved = report.published->landmark(report.landmarks.at(0)).position;
  EXPECT_LT((after * moved - before * position).norm(), 1e-10);
}

TEST_F(RebaseTest, NewLandmarkStaysWhereItsOwnEditSetItsKeyframe) {
  early->set_poses({{{kSecond, random_pose(random, 1)}}, {}});
  late->set_poses({{{kSecond, random_pose(random, 1)}}, {}});
  const Eigen::Vector3d position = random_point(random);
  late->add_landmark(position, {{kSecond, FeatureId(40)}});
  const CommitReport report = commit();
  EXPECT_EQ(report.published->landmark(report.landmarks.at(0)).position, position);
}

TEST_F(RebaseTest, NewObservationIsForwardedOrDropped) {
  early->merge_landmarks(LandmarkId(0), LandmarkId(20));
  early->remove_landmark(LandmarkId(1));
  early->add_landmark(random_point(random), {{kRoot, FeatureId(42)}});
  MapDraft setup(store.snapshot());
  for (std::size_t i = 0; i < 30; ++i) setup.remove_observation(LandmarkId(i), kRoot);
  store.commit(std::move(setup));
  late.emplace(store.snapshot());
  EXPECT_TRUE(late->add_observation(LandmarkId(0), {kRoot, FeatureId(40), false}));
  EXPECT_TRUE(late->add_observation(LandmarkId(1), {kRoot, FeatureId(41)}));
  EXPECT_TRUE(late->add_observation(LandmarkId(2), {kRoot, FeatureId(42)}));
  const CommitReport report = commit();
  EXPECT_EQ(report.published->landmark_of(kRoot, FeatureId(40)), LandmarkId(20));
  EXPECT_FALSE(report.published->observations(LandmarkId(20)).front().aligned);
  EXPECT_FALSE(report.published->landmark_of(kRoot, FeatureId(41)).valid());
  EXPECT_EQ(report.published->landmark_of(kRoot, FeatureId(42)), LandmarkId(30));
  EXPECT_EQ(report.applied, 1u);
  EXPECT_EQ(report.dropped, 2u);
}

TEST_F(RebaseTest, NewObservationInARemovedKeyframeIsDropped) {
  early->remove_keyframe(kThird);
  late->remove_observation(LandmarkId(3), kThird);
  late->add_observation(LandmarkId(3), {kThird, FeatureId(40)});
  const CommitReport report = commit();
  EXPECT_EQ(report.dropped, 2u);
}

TEST_F(RebaseTest, RemovalOfAnObservationIsDroppedIfItNoLongerExists) {
  early->remove_observation(LandmarkId(0), kThird);
  early->merge_landmarks(LandmarkId(1), LandmarkId(2));
  late->remove_observation(LandmarkId(0), kThird);
  late->remove_observation(LandmarkId(1), kThird);
  late->remove_observation(LandmarkId(4), kThird);
  const CommitReport report = commit();
  EXPECT_EQ(report.dropped, 2u);
  EXPECT_EQ(report.applied, 1u);
  EXPECT_EQ(report.published->observations(LandmarkId(0)).size(), 2u);
  EXPECT_EQ(report.published->observations(LandmarkId(2)).size(), 3u);
  EXPECT_EQ(report.published->observations(LandmarkId(4)).size(), 2u);
}

TEST_F(RebaseTest, RemovalOfALandmarkIsDroppedIfANewerKeyframeObservesIt) {
  add_keyframe(*early, same_numbers(0, 2));
  early->remove_landmark(LandmarkId(3));
  for (const std::size_t i : {0u, 2u, 3u}) late->remove_landmark(LandmarkId(i));
  const CommitReport report = commit();
  EXPECT_TRUE(report.published->alive(LandmarkId(0)));
  EXPECT_FALSE(report.published->alive(LandmarkId(2)));
  EXPECT_FALSE(report.published->alive(LandmarkId(3)));
  EXPECT_EQ(report.dropped, 2u);
}

TEST_F(RebaseTest, MergesForwardBothEnds) {
  early->merge_landmarks(LandmarkId(0), LandmarkId(10));
  early->merge_landmarks(LandmarkId(1), LandmarkId(11));
  early->merge_landmarks(LandmarkId(2), LandmarkId(3));
  early->remove_landmark(LandmarkId(5));
  late->merge_landmarks(LandmarkId(0), LandmarkId(1));
  late->merge_landmarks(LandmarkId(3), LandmarkId(2));
  late->merge_landmarks(LandmarkId(4), LandmarkId(5));
  const CommitReport report = commit();
  EXPECT_EQ(report.published->resolve(LandmarkId(10)), LandmarkId(11));
  EXPECT_EQ(report.published->resolve(LandmarkId(2)), LandmarkId(3));
  EXPECT_TRUE(report.published->alive(LandmarkId(4)));
  EXPECT_EQ(report.applied, 1u);
  EXPECT_EQ(report.dropped, 2u);
}

TEST_F(RebaseTest, RemovalOfAKeyframeIsDroppedIfRemovedAndReassignsNewerChildren) {
  early->remove_keyframe(kSecond);
  const KeyframeId child = add_keyframe(*early, {}, kThird);
  late->remove_keyframe(kSecond);
  late->remove_keyframe(kThird);
  const CommitReport report = commit();
  EXPECT_EQ(report.dropped, 1u);
  EXPECT_EQ(report.applied, 1u);
  EXPECT_EQ(report.published->keyframe(child).parent, kRoot);
}

TEST_F(RebaseTest, NewKeyframesDoNotDependOnTheOrderOfTwoEdits) {
  const auto frame = synthetic_frame(random, 2, 30, 10);
  const SE3 T_new_world = random_pose(random, 1), T_third_new = random_pose(random, 1);
  std::vector<SE3> ends;
  for (const bool keyframe_first : {true, false}) {
    MapStore copy{BundledMap(*store.snapshot())};
    MapDraft adding(copy.snapshot()), moving(copy.snapshot());
    const KeyframeId k = adding.add_keyframe(frame, T_new_world, same_numbers(0, 3), {});
    moving.set_poses({{{kThird, T_third_new}}, {}});
    copy.commit(std::move(keyframe_first ? adding : moving));
    copy.commit(std::move(keyframe_first ? moving : adding));
    ends.push_back(copy.snapshot()->keyframe(k).T_rig_world);
  }
  expect_near(ends[0], ends[1]);
}

// A keyframe may be rescaled where it is: it is fixed while the size of its submap changes.
TEST_F(RebaseTest, NewKeyframesAreRescaledWithAKeyframeThatStays) {
  const auto frame = synthetic_frame(random, 2, 30, 10);
  const SE3 T_new_world = random_pose(random, 1), T_third_new = random_pose(random, 1);
  const SE3 T_root_world = store.snapshot()->keyframe(kRoot).T_rig_world;
  constexpr double kChange = 1.3;
  for (const bool keyframe_first : {true, false}) {
    MapStore copy{BundledMap(*store.snapshot())};
    MapDraft adding(copy.snapshot()), moving(copy.snapshot());
    const KeyframeId k = adding.add_keyframe(frame, T_new_world, {}, kRoot);
    moving.set_poses({.keyframes = {{kThird, T_third_new}},
                      .landmarks = {},
                      .scale_changes = {{kRoot, kChange}, {kThird, kChange}}});
    copy.commit(std::move(keyframe_first ? adding : moving));
    copy.commit(std::move(keyframe_first ? moving : adding));
    const MapSnapshot after = copy.snapshot();
    expect_near(after->keyframe(kRoot).T_rig_world, T_root_world);
    expect_near(after->keyframe(k).T_rig_world * T_root_world.inverse(),
                geometry::scaled(T_new_world * T_root_world.inverse(), kChange));
  }
}

TEST_F(RebaseTest, VisibilityCountsAreForwardedAndAdded) {
  early->add_visibility_counts({{LandmarkId(1), 10, 5}});
  early->merge_landmarks(LandmarkId(0), LandmarkId(1));
  early->remove_landmark(LandmarkId(2));
  late->add_visibility_counts({{LandmarkId(0), 2, 1}, {LandmarkId(2), 1, 1}});
  late->add_visibility_counts({{LandmarkId(2), 1, 1}});
  const CommitReport report = commit();
  EXPECT_EQ(report.published->landmark(LandmarkId(1)).expected, 12u);
  EXPECT_EQ(report.published->landmark(LandmarkId(1)).found, 6u);
  EXPECT_EQ(report.applied, 1u);
  EXPECT_EQ(report.dropped, 1u);
}

TEST_F(RebaseTest, RefreshesAreForwarded) {
  early->merge_landmarks(LandmarkId(0), LandmarkId(1));
  early->set_poses({{}, {{LandmarkId(1), {1, 2, 3}}}});
  early->remove_landmark(LandmarkId(2));
  late->refresh_landmarks({LandmarkId(0)});
  late->refresh_landmarks({LandmarkId(2)});
  const CommitReport report = commit();
  BundledMap expected = *report.published;
  expected.refresh_landmark(LandmarkId(1));
  EXPECT_EQ(report.published->landmark(LandmarkId(1)).view_direction, expected.landmark(LandmarkId(1)).view_direction);
  EXPECT_EQ(report.applied, 1u);
  EXPECT_EQ(report.dropped, 1u);
}

}  // namespace
}  // namespace bslam::map
