// The rebase rules for submaps, their scale, and the rig.
#include <gtest/gtest.h>

#include "map/rebase.h"
#include "rebase_fixture.h"

namespace bslam::map {
namespace {

using geometry::SE3;

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

// The edit did not see the newer submap, which may have an arbitrary unit of length.
TEST_F(RebaseTest, AMapWithANewerSubmapIsNotDeclaredMetric) {
  early->set_scale(Scale::kUnobservable);
  add_keyframe(*early, {});
  late->set_scale(Scale::kMetric, 0.01);
  const CommitReport report = commit();
  EXPECT_EQ(report.dropped, 1u);
  EXPECT_EQ(report.published->scale(), Scale::kUnobservable);
}

TEST_F(RebaseTest, AMapWithANewerKeyframeOfAKnownSubmapIsDeclaredMetric) {
  early->set_scale(Scale::kUnobservable);
  add_keyframe(*early, same_numbers(0, 30));
  late->set_scale(Scale::kMetric, 0.01);
  EXPECT_EQ(commit().published->scale(), Scale::kMetric);
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

// Two adjustments from one version of the map find the same errors of the stamps.
TEST_F(RebaseTest, TheLastCaptureTimesAreKeptAndThoseOfARemovedKeyframeDropped) {
  early->correct_times({{kSecond, CameraIndex(0), 2'000'000}});
  early->remove_keyframe(kThird);
  const KeyframeId newer = add_keyframe(*late, same_numbers(0, 5));
  const TimeNs before = late->map().keyframe(kSecond).frame->cameras[0].time_ns;
  late->correct_times(
      {{kSecond, CameraIndex(0), 3'000'000}, {kThird, CameraIndex(0), 1'000'000}, {newer, CameraIndex(0), -1'000'000}});
  EXPECT_EQ(late->map().keyframe(kSecond).frame->cameras[0].time_ns, before + 3'000'000);
  const CommitReport report = commit();
  const frame::CameraFrame& camera = report.published->keyframe(kSecond).frame->cameras[0];
  EXPECT_EQ(camera.time_ns, before + 3'000'000);
  EXPECT_EQ(camera.correction_ns, 3'000'000);
  EXPECT_EQ(report.published->keyframe(report.keyframes.at(0)).frame->cameras[0].correction_ns, -1'000'000);
  EXPECT_FALSE(report.published->alive(kThird));
}

// They were estimated together with poses, which are dropped as well.
TEST_F(RebaseTest, CaptureTimesAreDroppedAfterACorrectionOfTheMap) {
  SetPoses correction;
  correction.keyframes.emplace_back(kSecond, early->map().keyframe(kSecond).T_rig_world);
  correction.correction = true;
  early->set_poses(std::move(correction));
  late->correct_times({{kSecond, CameraIndex(0), 3'000'000}});
  EXPECT_EQ(commit().published->keyframe(kSecond).frame->cameras[0].correction_ns, 0);
}

// The rig with longer focal lengths.
camera::Rig zoomed(const camera::Rig& rig) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c)
    cameras.push_back({camera::zoomed(rig.camera(c), 1.1), rig.body_from_cam(c)});
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
