// At least one test for every rebase rule of map_edit.h.
#include "map/rebase.h"

#include <gtest/gtest.h>

#include "camera/model_parameters.h"
#include "synthetic_map.h"

namespace bslam::map {
namespace {

using Matches = std::vector<std::pair<FeatureId, LandmarkId>>;
using geometry::SE3;

constexpr KeyframeId kRoot{0}, kSecond{1}, kThird{2};

// Keyframes 0, 1, 2 form a chain; landmark i < 30 is observed by all of them with feature i. `early` and `late` start
// from the same version, and `early` is committed first.
class RebaseTest : public testing::Test {
 protected:
  RebaseTest() {
    MapDraft draft(store.snapshot());
    add_keyframe(draft, {});
    for (std::size_t i = 0; i < 30; ++i) draft.add_landmark(random_point(random), {{kRoot, FeatureId(i)}});
    for (int i = 0; i < 2; ++i) add_keyframe(draft, same_numbers(0, 30));
    store.commit(std::move(draft));
    early.emplace(store.snapshot());
    late.emplace(store.snapshot());
  }

  static Matches same_numbers(std::size_t from, std::size_t to) {
    Matches list;
    for (std::size_t i = from; i < to; ++i) list.emplace_back(FeatureId(i), LandmarkId(i));
    return list;
  }
  KeyframeId add_keyframe(MapDraft& draft, Matches list, KeyframeId fallback = {}) {
    return draft.add_keyframe(synthetic_frame(random, 2, 30, 10), random_pose(random, 0.5), std::move(list), fallback);
  }
  // Adds a submap of one keyframe to the version on which both drafts are based.
  KeyframeId begin_submap() {
    MapDraft setup(store.snapshot());
    const KeyframeId root = add_keyframe(setup, {});
    store.commit(std::move(setup));
    early.emplace(store.snapshot());
    late.emplace(store.snapshot());
    return root;
  }
  // Commits both drafts and returns the report of the late one.
  CommitReport commit() {
    store.commit(*std::move(early));
    CommitReport report = store.commit(*std::move(late));
    EXPECT_TRUE(report.rebased || report.rejected);
    EXPECT_EQ(report.published->check_invariants().value_or("valid"), "valid");
    return report;
  }

  static void expect_near(const SE3& a, const SE3& b) { EXPECT_LT((a.inverse() * b).log().norm(), 1e-10); }

  Random random{3, "rebase test"};
  MapStore store{BundledMap(synthetic_rig(2))};
  std::optional<MapDraft> early, late;
};

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

TEST_F(RebaseTest, SubmapsAreMergedIfBothStillExistSeparately) {
  const KeyframeId root = begin_submap();
  const KeyframeId newer = add_keyframe(*early, {}, root);
  late->merge_submaps(root, kThird);
  const CommitReport report = commit();
  EXPECT_EQ(report.applied, 1u);
  EXPECT_EQ(report.published->keyframe(root).parent, kThird);
  EXPECT_EQ(report.published->root_of(newer), kRoot);
}

TEST_F(RebaseTest, MergingIsDroppedIfAlreadyDone) {
  const KeyframeId root = begin_submap();
  early->merge_submaps(root, kSecond);
  late->merge_submaps(root, kThird);
  const CommitReport report = commit();
  EXPECT_EQ(report.dropped, 1u);
  EXPECT_EQ(report.published->keyframe(root).parent, kSecond);
}

TEST_F(RebaseTest, MergingUsesTheAncestorOfARemovedKeyframe) {
  const KeyframeId root = begin_submap();
  early->remove_keyframe(kThird);
  late->merge_submaps(root, kThird);
  const CommitReport report = commit();
  EXPECT_EQ(report.dropped, 0u);
  EXPECT_EQ(report.published->root_of(root), report.published->root_of(kSecond));
}

TEST_F(RebaseTest, MergingIsDroppedIfASubmapWasRemoved) {
  const KeyframeId root = begin_submap();
  early->remove_submap(root);
  late->merge_submaps(root, kSecond);
  EXPECT_EQ(commit().dropped, 1u);
}

TEST_F(RebaseTest, MergingFollowsTheIdsOfTheEditsOwnKeyframes) {
  add_keyframe(*early, same_numbers(0, 3));
  const KeyframeId own = add_keyframe(*late, {});
  late->merge_submaps(own, kSecond);
  const CommitReport report = commit();
  EXPECT_NE(report.keyframes.at(0), own);
  EXPECT_EQ(report.published->keyframe(report.keyframes[0]).parent, kSecond);
  EXPECT_EQ(report.published->roots(), std::vector{kRoot});
}

TEST_F(RebaseTest, RemovalOfASubmapRemovesItsNewerKeyframes) {
  const KeyframeId root = begin_submap();
  const KeyframeId newer = add_keyframe(*early, {}, root);
  late->remove_submap(root);
  const CommitReport report = commit();
  EXPECT_EQ(report.applied, 1u);
  EXPECT_FALSE(report.published->alive(root));
  EXPECT_FALSE(report.published->alive(newer));
  EXPECT_EQ(report.published->roots(), std::vector{kRoot});
}

TEST_F(RebaseTest, RemovalOfASubmapIsDroppedIfItWasRemovedOrMerged) {
  const KeyframeId root = begin_submap();
  early->merge_submaps(root, kThird);
  late->remove_submap(root);
  EXPECT_EQ(commit().dropped, 1u);
  EXPECT_TRUE(store.snapshot()->alive(root));
  const KeyframeId other = begin_submap();
  early->remove_submap(other);
  late->remove_submap(other);
  EXPECT_EQ(commit().dropped, 1u);
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

TEST_F(RebaseTest, ScalingASubmapScalesNewerKeyframesAndLandmarks) {
  const KeyframeId newer = add_keyframe(*early, same_numbers(0, 20));
  const LandmarkId point = early->add_landmark({1, 2, 3}, {{newer, FeatureId(25)}});
  const SE3 T_rig_world = early->map().keyframe(newer).T_rig_world;
  late->scale_submap(kRoot, 2.0);
  const CommitReport report = commit();
  EXPECT_EQ(report.applied, 1u);
  EXPECT_EQ(report.published->keyframe(newer).T_rig_world.translation(), 2.0 * T_rig_world.translation());
  EXPECT_EQ(report.published->landmark(point).position, Eigen::Vector3d(2, 4, 6));
}

TEST_F(RebaseTest, AdditionsToAScaledSubmapKeepTheirRelativePose) {
  const KeyframeId k = add_keyframe(*late, same_numbers(0, 20), kThird);
  late->remove_observation(LandmarkId(29), kThird);
  late->add_landmark({1, 2, 3}, {{kThird, FeatureId(29)}});
  late->add_landmark({3, 2, 1}, {{k, FeatureId(25)}});
  const SE3 T_rig_world = late->map().keyframe(k).T_rig_world;
  early->scale_submap(kRoot, 2.0);
  const CommitReport report = commit();
  const SE3 now = report.published->keyframe(report.keyframes.front()).T_rig_world;
  expect_near(now, SE3(T_rig_world.rotation(), 2.0 * T_rig_world.translation()));
  ASSERT_EQ(report.landmarks.size(), 2u);
  EXPECT_NEAR((report.published->landmark(report.landmarks[0]).position - Eigen::Vector3d(2, 4, 6)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((report.published->landmark(report.landmarks[1]).position - Eigen::Vector3d(6, 4, 2)).norm(), 0.0, 1e-12);
}

TEST_F(RebaseTest, PosesInAnOldUnitAreDropped) {
  const SE3 before = early->map().keyframe(kSecond).T_rig_world;
  late->set_poses({{{kSecond, random_pose(random, 0.5)}}, {}, false});
  early->scale_submap(kRoot, 2.0);
  const CommitReport report = commit();
  EXPECT_EQ(report.dropped, 1u);
  EXPECT_EQ(report.published->keyframe(kSecond).T_rig_world.translation(), 2.0 * before.translation());
}

TEST_F(RebaseTest, TheSecondOfTwoConcurrentScalingsIsRejected) {
  const SE3 before = early->map().keyframe(kSecond).T_rig_world;
  early->scale_submap(kRoot, 2.0);
  late->scale_submap(kRoot, 3.0);
  const CommitReport report = commit();
  EXPECT_TRUE(report.rejected);
  EXPECT_EQ(report.published->keyframe(kSecond).T_rig_world.translation(), 2.0 * before.translation());
}

TEST_F(RebaseTest, TheLaterEditDeterminesTheScale) {
  early->set_scale(Scale::kUpToScale);
  late->set_scale(Scale::kUnobservable);
  const CommitReport report = commit();
  EXPECT_EQ(report.published->scale(), Scale::kUnobservable);
  EXPECT_EQ(report.applied, 1u);
}

TEST_F(RebaseTest, MotionScalesWithTheSubmapAndIsDroppedWithItsKeyframe) {
  geometry::Vector6d twist;
  twist << 0.1, 0.2, 0.3, 1.0, 2.0, 3.0;
  early->scale_submap(kRoot, 2.0);
  early->remove_keyframe(kThird);
  const KeyframeId newer = add_keyframe(*late, same_numbers(0, 5));
  late->set_twists({{kSecond, twist}, {kThird, twist}, {newer, twist}});
  EXPECT_EQ(late->map().keyframe(kSecond).twist, twist);
  const CommitReport report = commit();
  for (const KeyframeId k : {kSecond, report.keyframes.at(0)}) {
    EXPECT_EQ(report.published->keyframe(k).twist.head<3>(), twist.head<3>());
    EXPECT_EQ(report.published->keyframe(k).twist.tail<3>(), 2.0 * twist.tail<3>());
  }
  EXPECT_FALSE(report.published->alive(kThird));
}

// The rig with longer focal lengths.
camera::Rig zoomed(const camera::Rig& rig) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    camera::Camera camera = rig.camera(c);
    camera::ModelParameters p = camera::parameters(camera.model);
    p.head<2>() *= 1.1;
    camera.model = camera::with_parameters(camera.model, p);
    cameras.push_back({camera, rig.body_from_cam(c)});
  }
  return camera::Rig(std::move(cameras));
}

void expect_bearings_of_rig(const BundledMap& map, KeyframeId k) {
  for (std::size_t c = 0; c < map.rig().size(); ++c) {
    const feature::Keypoints& keypoints = map.keypoints(k, CameraIndex(c));
    ASSERT_GT(keypoints.size(), 0u);
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      const auto bearing = map.rig().camera(c).unproject(keypoints.pixel[i].cast<double>());
      if (bearing) {
        EXPECT_EQ(keypoints.bearing[i], *bearing);
      }
    }
  }
}

TEST_F(RebaseTest, NewerKeyframesGetTheBearingsOfANewRig) {
  const KeyframeId newer = add_keyframe(*early, same_numbers(0, 10));
  const auto deviation = std::make_shared<const Eigen::MatrixXd>(Eigen::MatrixXd::Identity(14, 14));
  late->set_rig(zoomed(late->map().rig()), deviation);
  const MapSnapshot map = commit().published;
  EXPECT_EQ(map->rig_deviation(), deviation);
  EXPECT_TRUE(map->rig().same_calibration(zoomed(*synthetic_rig(2))));
  for (const KeyframeId k : {kRoot, kSecond, newer}) expect_bearings_of_rig(*map, k);
}

TEST_F(RebaseTest, AKeyframeOfAnEarlierRigGetsTheBearingsOfTheNewOne) {
  early->set_rig(zoomed(early->map().rig()));
  add_keyframe(*late, same_numbers(0, 10));
  const CommitReport report = commit();
  ASSERT_EQ(report.keyframes.size(), 1u);
  expect_bearings_of_rig(*report.published, report.keyframes.front());
  expect_bearings_of_rig(*report.published, kThird);
}

}  // namespace
}  // namespace bslam::map
