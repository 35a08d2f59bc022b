#include "map/bundled_map.h"

#include <gtest/gtest.h>

#include "feature/hamming.h"
#include "synthetic_map.h"

namespace bslam::map {
namespace {

using Matches = std::vector<std::pair<FeatureId, LandmarkId>>;
using geometry::SE3;

Matches matches(std::size_t from, std::size_t to) {
  Matches list;
  for (std::size_t i = from; i < to; ++i) list.emplace_back(FeatureId(i), LandmarkId(i));
  return list;
}

// Keyframe 0 observes landmarks 0 ... 39 with the features of the same number; each test adds further keyframes.
// Features 0 ... 9 have two keypoints.
class BundledMapTest : public testing::Test {
 protected:
  BundledMapTest() {
    add({}, {});
    for (std::size_t i = 0; i < 40; ++i) {
      const std::vector<Observation> first = {{KeyframeId(0), FeatureId(i)}};
      map.add_landmark(random_point(random), first);
    }
  }
  KeyframeId add(const Matches& list, KeyframeId fallback) {
    return map.add_keyframe(synthetic_frame(random, 2, 30, 10), random_pose(random, 0.5), list, fallback);
  }
  void expect_valid() { EXPECT_EQ(map.check_invariants().value_or("valid"), "valid"); }

  Random random{7, "bundled map test"};
  BundledMap map{synthetic_rig(2)};
};

TEST_F(BundledMapTest, CountsKeypointsAsObservations) {
  EXPECT_EQ(map.num_observations(), 40u + 10u);
  EXPECT_EQ(map.num_landmarks(), 40u);
  map.remove_observation(LandmarkId(0), KeyframeId(0));
  EXPECT_EQ(map.num_observations(), 48u);
  EXPECT_EQ(map.num_landmarks(), 39u);
  expect_valid();
}

TEST_F(BundledMapTest, AttachesAKeyframeToTheOneItSharesMostLandmarksWith) {
  EXPECT_FALSE(map.keyframe(KeyframeId(0)).parent.valid());
  const KeyframeId a = add(matches(0, 10), {});
  EXPECT_EQ(map.keyframe(a).parent, KeyframeId(0));
  const KeyframeId b = add(matches(5, 10), {});  // five shared with each: the newer one is the parent
  EXPECT_EQ(map.keyframe(b).parent, a);
  const KeyframeId c = add(matches(8, 30), {});
  EXPECT_EQ(map.keyframe(c).parent, KeyframeId(0));
  const KeyframeId d = add({}, a);
  EXPECT_EQ(map.keyframe(d).parent, a);
  expect_valid();
}

TEST_F(BundledMapTest, StartsASubmapWithAKeyframeWithoutParent) {
  const KeyframeId a = add(matches(0, 10), {});
  const KeyframeId b = add({}, {}), c = add({}, b), d = add({}, KeyframeId(77));
  EXPECT_EQ(map.roots(), (std::vector{KeyframeId(0), b, d}));
  EXPECT_EQ(map.root_of(a), KeyframeId(0));
  EXPECT_EQ(map.root_of(c), b);
  EXPECT_EQ(map.root_of(d), d);
  EXPECT_EQ(map.root_of_each(), (std::vector{KeyframeId(0), KeyframeId(0), b, b, d}));
  map.remove_keyframe(c);
  EXPECT_FALSE(map.keyframe(add({}, c)).parent.valid());  // a removed keyframe cannot become a parent
  expect_valid();
}

TEST_F(BundledMapTest, ReversesTheLinksWhenSubmapsAreMerged) {
  const KeyframeId a = add(matches(0, 10), {});
  const KeyframeId r = add({}, {}), s = add({}, r), t = add({}, s), side = add({}, r), below = add({}, t);
  std::vector<SE3> poses;
  for (const KeyframeId k : map.keyframe_ids()) poses.push_back(map.keyframe(k).T_rig_world);
  EXPECT_TRUE(map.merge_submaps(t, a));
  EXPECT_EQ(map.keyframe(t).parent, a);
  EXPECT_EQ(map.keyframe(s).parent, t);
  EXPECT_EQ(map.keyframe(r).parent, s);
  EXPECT_EQ(map.keyframe(side).parent, r);
  EXPECT_EQ(map.keyframe(below).parent, t);
  EXPECT_EQ(map.roots(), std::vector{KeyframeId(0)});
  EXPECT_EQ(map.root_of_each(), std::vector(7, KeyframeId(0)));
  for (const KeyframeId k : map.keyframe_ids()) {
    EXPECT_EQ(map.root_of(k), KeyframeId(0));
    EXPECT_EQ(map.keyframe(k).T_rig_world.translation(), poses[k.index()].translation());
  }
  expect_valid();
}

TEST_F(BundledMapTest, MergesOnlyAliveKeyframesOfTwoSubmaps) {
  const KeyframeId a = add(matches(0, 10), {}), r = add({}, {}), s = add({}, r);
  EXPECT_FALSE(map.merge_submaps(a, KeyframeId(0)));
  EXPECT_FALSE(map.merge_submaps(r, s));
  map.remove_keyframe(s);
  EXPECT_FALSE(map.merge_submaps(s, a));
  EXPECT_FALSE(map.merge_submaps(a, s));
  EXPECT_FALSE(map.merge_submaps(KeyframeId(), a));
  EXPECT_TRUE(map.merge_submaps(a, r));  // the larger submap may be attached to the smaller one
  EXPECT_EQ(map.roots(), std::vector{r});
  expect_valid();
}

TEST_F(BundledMapTest, RemovesOneSubmapOnly) {
  const KeyframeId a = add(matches(0, 10), {});
  const KeyframeId r = add({}, {}), s = add({}, r), t = add({}, s);
  const LandmarkId own =
      map.add_landmark(random_point(random), std::vector<Observation>{{r, FeatureId(1)}, {t, FeatureId(1)}});
  const LandmarkId shared =
      map.add_landmark(random_point(random), std::vector<Observation>{{a, FeatureId(20)}, {s, FeatureId(2)}});
  const std::size_t observations = map.num_observations();
  EXPECT_FALSE(map.remove_submap(s));
  EXPECT_TRUE(map.remove_submap(r));
  for (const KeyframeId k : {r, s, t}) {
    EXPECT_FALSE(map.alive(k));
    EXPECT_FALSE(map.nearest_alive_ancestor(k).valid());
  }
  EXPECT_EQ(map.roots(), std::vector{KeyframeId(0)});
  EXPECT_EQ(map.num_keyframes(), 2u);
  EXPECT_FALSE(map.alive(own));
  ASSERT_TRUE(map.alive(shared));  // the other submap observes it too
  EXPECT_EQ(map.observations(shared).size(), 1u);
  EXPECT_EQ(map.num_observations(), observations - 3 * 2);  // three features with two keypoints each
  EXPECT_FALSE(map.remove_submap(r));
  EXPECT_FALSE(map.remove_submap(KeyframeId()));
  expect_valid();
}

TEST_F(BundledMapTest, ScalesASubmapWithItsRemovedKeyframesOnly) {
  const KeyframeId a = add(matches(0, 20), {}), gone = add(matches(0, 10), {});
  const KeyframeId r = add({}, {}), s = add({}, r);
  const LandmarkId theirs = map.add_landmark(random_point(random), std::vector<Observation>{{s, FeatureId(2)}});
  ASSERT_TRUE(map.remove_keyframe(gone));
  const BundledMap before = map;
  EXPECT_FALSE(map.scale_submap(a, 3.0));
  EXPECT_TRUE(map.scale_submap(KeyframeId(0), 3.0));
  for (const KeyframeId k : {KeyframeId(0), a, gone}) {
    const SE3 old = before.resolved_pose(k);
    EXPECT_LT((map.resolved_pose(k).translation() - 3.0 * old.translation()).norm(), 1e-12);
    EXPECT_LT(map.resolved_pose(k).rotation().angularDistance(old.rotation()), 1e-7);
    EXPECT_EQ(map.keyframe(k).scale, 3.0);
  }
  EXPECT_EQ(map.landmark(LandmarkId(5)).position, 3.0 * before.landmark(LandmarkId(5)).position);
  EXPECT_EQ(map.landmark(LandmarkId(5)).max_distance, 3.0f * before.landmark(LandmarkId(5)).max_distance);
  EXPECT_EQ(map.keyframe(s).T_rig_world.translation(), before.keyframe(s).T_rig_world.translation());
  EXPECT_EQ(map.landmark(theirs).position, before.landmark(theirs).position);
  EXPECT_EQ(map.gauge_epoch(), before.gauge_epoch() + 1);
  expect_valid();
}

TEST_F(BundledMapTest, ANewKeyframeHasTheErrorOfItsParent) {
  geometry::Vector6d deviations;
  deviations << 1, 2, 3, 4, 5, 6;
  const geometry::Matrix6d covariance = deviations.asDiagonal();
  ASSERT_TRUE(map.set_uncertainty(KeyframeId(0), {covariance}));
  const KeyframeId k = add(matches(0, 20), {});
  const geometry::Matrix6d A =
      (map.keyframe(k).T_rig_world * map.keyframe(KeyframeId(0)).T_rig_world.inverse()).adjoint();
  EXPECT_LT((map.keyframe(k).uncertainty.noise - A * covariance * A.transpose()).norm(), 1e-12 * covariance.norm());
  EXPECT_EQ(map.keyframe(add({}, {})).uncertainty.noise, geometry::Matrix6d::Zero());  // a root
}

TEST_F(BundledMapTest, UncertaintiesFollowChangesOfTheScale) {
  const KeyframeId k = add(matches(0, 20), {});
  geometry::Matrix6d expected = geometry::Matrix6d::Ones();
  map.set_uncertainty(k, {expected});
  map.scale_submap(KeyframeId(0), 2.0);
  map.scale_keyframes(std::vector<std::pair<KeyframeId, double>>{{k, 1.5}});
  expected.bottomLeftCorner<3, 3>().setConstant(3.0);
  expected.topRightCorner<3, 3>().setConstant(3.0);
  expected.bottomRightCorner<3, 3>().setConstant(9.0);
  EXPECT_EQ(map.keyframe(k).uncertainty.noise, expected);
}

TEST_F(BundledMapTest, ResolvesRemovedKeyframesToTheNearestAliveAncestor) {
  const KeyframeId a = add(matches(0, 20), {}), b = add(matches(0, 10), {}), c = add({}, b);
  EXPECT_EQ(map.nearest_alive_ancestor(c), c);
  map.remove_keyframe(c);
  EXPECT_EQ(map.nearest_alive_ancestor(c), b);
  map.remove_keyframe(b);
  map.remove_keyframe(a);
  EXPECT_EQ(map.nearest_alive_ancestor(c), KeyframeId(0));
  EXPECT_FALSE(map.nearest_alive_ancestor(KeyframeId()).valid());
}

TEST_F(BundledMapTest, KeepsTheGivenBirthKeyframeOfALandmark) {
  const KeyframeId a = add({}, KeyframeId(0)), b = add({}, a);
  const std::vector<Observation> observations = {{b, FeatureId(3)}};
  EXPECT_EQ(map.landmark(map.add_landmark(random_point(random), observations, {}, a)).born, a);
}

TEST_F(BundledMapTest, OrdersCovisibleKeyframesByWeightThenAge) {
  const KeyframeId a = add(matches(0, 10), {}), b = add(matches(0, 10), {}), c = add(matches(0, 3), {});
  const auto best = map.best_covisible(a, 100);
  ASSERT_EQ(best.size(), 3u);
  EXPECT_EQ(best[0].keyframe, b);
  EXPECT_EQ(best[0].weight, 10);
  EXPECT_EQ(best[1].keyframe, KeyframeId(0));
  EXPECT_EQ(best[2].keyframe, c);
  EXPECT_EQ(map.best_covisible(a, 1).size(), 1u);
  EXPECT_EQ(map.best_covisible(a, 100, 4).size(), 2u);
}

TEST_F(BundledMapTest, RejectsDuplicateObservationsAndUsedFeatures) {
  const KeyframeId a = add(matches(0, 5), {});
  EXPECT_FALSE(map.add_observation(LandmarkId(0), {a, FeatureId(20)}));
  EXPECT_FALSE(map.add_observation(LandmarkId(9), {a, FeatureId(4)}));
  EXPECT_TRUE(map.add_observation(LandmarkId(9), {a, FeatureId(20)}));
  EXPECT_EQ(map.landmark_of(a, FeatureId(20)), LandmarkId(9));
  map.remove_landmark(LandmarkId(9));
  EXPECT_FALSE(map.add_observation(LandmarkId(9), {a, FeatureId(21)}));
  EXPECT_FALSE(map.landmark_of(a, FeatureId(20)).valid());
  expect_valid();
}

TEST_F(BundledMapTest, PassesTheReferenceToTheOldestRemainingObservation) {
  const KeyframeId a = add(matches(0, 1), {}), b = add(matches(0, 1), {});
  map.remove_observation(LandmarkId(0), b);
  EXPECT_EQ(map.landmark(LandmarkId(0)).reference.keyframe, KeyframeId(0));
  map.remove_observation(LandmarkId(0), KeyframeId(0));
  const LandmarkReference& reference = map.landmark(LandmarkId(0)).reference;
  EXPECT_EQ(reference.keyframe, a);
  EXPECT_EQ(reference.keypoint, map.keyframe(a).frame->bundled.keypoints(FeatureId(0)).front());
  expect_valid();
}

TEST_F(BundledMapTest, KeepsAGivenReference) {
  const KeyframeId a = add({}, {});
  const std::vector<Observation> observations = {{KeyframeId(0), FeatureId(45)}, {a, FeatureId(0)}};
  const LandmarkReference second_camera{a, {CameraIndex(1), KeypointIndex(0)}};
  const LandmarkId l = map.add_landmark(random_point(random), observations, second_camera);
  EXPECT_EQ(map.landmark(l).reference.keypoint, second_camera.keypoint);
  EXPECT_EQ(map.landmark(l).born, a);
  expect_valid();
}

TEST_F(BundledMapTest, MovesObservationsAndCountersWhenMerging) {
  const KeyframeId a = add({{FeatureId(3), LandmarkId(3)}}, {});
  const KeyframeId b = add({{FeatureId(3), LandmarkId(3)}, {FeatureId(4), LandmarkId(4)}}, {});
  map.add_visibility_counts(LandmarkId(3), 5, 3);
  map.add_visibility_counts(LandmarkId(4), 2, 1);
  EXPECT_TRUE(map.merge_landmarks(LandmarkId(3), LandmarkId(4)));
  EXPECT_FALSE(map.alive(LandmarkId(3)));
  EXPECT_EQ(map.landmark(LandmarkId(4)).expected, 7u);
  EXPECT_EQ(map.landmark(LandmarkId(4)).found, 4u);
  EXPECT_EQ(map.landmark_of(a, FeatureId(3)), LandmarkId(4));
  for (const Observation& o : map.observations(LandmarkId(4))) {
    EXPECT_EQ(o.aligned, o.feature == FeatureId(4)) << "aligned to the reference patch of the other landmark";
  }
  EXPECT_FALSE(map.landmark_of(b, FeatureId(3)).valid());  // b already observes landmark 4 with feature 4
  EXPECT_TRUE(map.merge_landmarks(LandmarkId(4), LandmarkId(5)));
  EXPECT_EQ(map.resolve(LandmarkId(3)), LandmarkId(5));
  EXPECT_FALSE(map.merge_landmarks(LandmarkId(5), LandmarkId(5)));
  map.remove_landmark(LandmarkId(5));
  EXPECT_FALSE(map.resolve(LandmarkId(3)).valid());
  expect_valid();
}

TEST_F(BundledMapTest, FreesRemovedLandmarksButKeepsTheirMerges) {
  const auto freed = [](const BundledMap& m) { return &m.landmark(LandmarkId(0)) == &m.landmark(LandmarkId(16)); };
  for (int l = 0; l < 31; ++l) map.remove_landmark(LandmarkId(l));
  map.free_removed(1000);
  EXPECT_FALSE(freed(map));  // one landmark of the second block is alive
  map.merge_landmarks(LandmarkId(31), LandmarkId(39));
  const BundledMap before = map;
  map.free_removed(16);  // the first block
  EXPECT_FALSE(freed(map));
  map.free_removed(16);
  EXPECT_TRUE(freed(map));
  EXPECT_FALSE(freed(before));
  for (int l = 0; l < 32; ++l) {
    EXPECT_EQ(map.resolve(LandmarkId(l)), l == 31 ? LandmarkId(39) : LandmarkId());
    EXPECT_TRUE(map.observations(LandmarkId(l)).empty());
  }
  EXPECT_TRUE(map.alive(LandmarkId(33)));
  expect_valid();
}

TEST_F(BundledMapTest, KeepsATreeWhenAKeyframeIsRemoved) {
  const KeyframeId a = add(matches(0, 20), {});
  // child of a; shares 6 with a and 6 with keyframe 0: the newer one, a, is the parent
  const KeyframeId b = add(matches(0, 6), a);
  const KeyframeId c = add(matches(4, 20), {});  // child of a; shares 16 with a and keyframe 0, 2 with b
  const KeyframeId d = add({}, a);               // child of a without shared landmarks
  for (const KeyframeId k : {b, c, d}) EXPECT_EQ(map.keyframe(k).parent, a);
  const std::size_t before = map.num_keyframes();
  EXPECT_TRUE(map.remove_keyframe(a));
  EXPECT_EQ(map.num_keyframes(), before - 1);
  for (const KeyframeId k : {b, c, d}) EXPECT_EQ(map.keyframe(k).parent, KeyframeId(0));
  EXPECT_FALSE(map.remove_keyframe(a));
  EXPECT_FALSE(map.remove_keyframe(KeyframeId(0)));  // the root
  expect_valid();
}

TEST_F(BundledMapTest, ReassignsChildrenToASiblingWithTheStrongerLink) {
  const KeyframeId a = add(matches(0, 20), {});
  const KeyframeId b = add(matches(0, 15), {}), c = add(matches(0, 14), a);
  const std::vector<Observation> both = {{b, FeatureId(40)}, {c, FeatureId(40)}};
  ASSERT_EQ(map.keyframe(b).parent, a);
  ASSERT_EQ(map.keyframe(c).parent, b);
  const KeyframeId root_child = add({}, a);
  const KeyframeId sibling = add({}, a);
  const std::vector<Observation> link = {{root_child, FeatureId(1)}, {sibling, FeatureId(1)}};
  map.add_landmark(random_point(random), link);
  ASSERT_EQ(map.keyframe(sibling).parent, a);
  map.remove_keyframe(a);
  EXPECT_EQ(map.keyframe(b).parent, KeyframeId(0));
  EXPECT_EQ(map.keyframe(root_child).parent, KeyframeId(0));
  EXPECT_EQ(map.keyframe(sibling).parent, root_child);
  expect_valid();
}

TEST_F(BundledMapTest, MovesRemovedKeyframesWithTheirParents) {
  const KeyframeId a = add(matches(0, 20), {}), b = add(matches(0, 10), {});
  const SE3 T_b_a = map.keyframe(b).T_rig_world * map.keyframe(a).T_rig_world.inverse();
  const SE3 T_a_0 = map.keyframe(a).T_rig_world * map.keyframe(KeyframeId(0)).T_rig_world.inverse();
  ASSERT_EQ(map.keyframe(b).parent, a);
  map.remove_keyframe(b);
  map.remove_keyframe(a);
  const SE3 moved = random_pose(random, 1);
  map.set_pose(KeyframeId(0), moved);
  EXPECT_LT((map.resolved_pose(b).inverse() * T_b_a * T_a_0 * moved).log().norm(), 1e-12);
  EXPECT_LT((map.resolved_pose(a).inverse() * T_a_0 * moved).log().norm(), 1e-12);
  EXPECT_FALSE(map.keyframe(a).frame);
}

TEST_F(BundledMapTest, RefreshesTheAppearanceOfALandmark) {
  const LandmarkId l(2);
  std::vector<KeyframeId> keyframes = {KeyframeId(0)};
  for (int i = 0; i < 30; ++i) keyframes.push_back(add({{FeatureId(2), l}}, {}));
  map.refresh_landmark(l);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::vector<feature::Descriptor> descriptors;
  for (const KeyframeId k : keyframes) {
    for (const frame::KeypointRef& r : map.keyframe(k).frame->bundled.keypoints(FeatureId(2))) {
      const SE3 T_world_cam = (map.rig().cam_from_rig(r.camera) * map.keyframe(k).T_rig_world).inverse();
      sum += (map.landmark(l).position - T_world_cam.translation()).normalized();
      descriptors.push_back(map.keypoints(k, r.camera).descriptor[r.keypoint.index()]);
    }
  }
  EXPECT_LT((map.landmark(l).view_direction - sum.normalized()).norm(), 1e-12);

  descriptors.erase(descriptors.begin(), descriptors.end() - 24);
  int best_median = 257;
  feature::Descriptor best{};
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    std::vector<int> distances;
    for (std::size_t j = 0; j < descriptors.size(); ++j) {
      if (j != i) distances.push_back(feature::hamming(descriptors[i], descriptors[j]));
    }
    std::sort(distances.begin(), distances.end());
    if (distances[11] < best_median) {
      best_median = distances[11];
      best = descriptors[i];
    }
  }
  EXPECT_EQ(map.landmark(l).descriptor, best);

  const frame::KeypointRef r = map.landmark(l).reference.keypoint;
  const SE3 T_cam_world = map.rig().cam_from_rig(r.camera) * map.keyframe(KeyframeId(0)).T_rig_world;
  const double distance = (T_cam_world * map.landmark(l).position).norm();
  const int level = map.keypoints(KeyframeId(0), r.camera).level[r.keypoint.index()];
  EXPECT_NEAR(map.landmark(l).max_distance, distance * std::pow(1.2, level), 1e-5);
  EXPECT_NEAR(map.landmark(l).min_distance, distance * std::pow(1.2, level - 7), 1e-5);
}

// The pose of a camera with a late capture time follows the motion of the rig; scaling a submap scales that motion.
TEST_F(BundledMapTest, ComputesThePoseOfALateCamera) {
  auto frame = std::make_shared<frame::BundledFrame>(*synthetic_frame(random, 2, 30, 10));
  frame->time_ns = 1'000'000'000;
  for (frame::CameraFrame& c : frame->cameras) c.state = image::ImageState::kPresent;
  frame->cameras[0].time_ns = frame->time_ns;
  frame->cameras[1].time_ns = frame->time_ns + 30'000'000;
  frame->twist << 0.4, -0.2, 0.1, 1.0, 0.3, -0.5;
  const SE3 T_rig_world = random_pose(random, 0.5);
  const KeyframeId k = map.add_keyframe(frame, T_rig_world, {}, KeyframeId());
  EXPECT_EQ(map.cam_from_world(k, CameraIndex(0)).matrix(), T_rig_world.matrix());
  const SE3 then = SE3::exp(0.03 * frame->twist) * T_rig_world;
  EXPECT_TRUE(map.cam_from_world(k, CameraIndex(1))
                  .matrix()
                  .isApprox((map.rig().cam_from_rig(CameraIndex(1)) * then).matrix(), 1e-12));
  const camera::Rig rig = map.rig_of(k);
  EXPECT_TRUE((rig.cam_from_rig(CameraIndex(1)) * T_rig_world)
                  .matrix()
                  .isApprox(map.cam_from_world(k, CameraIndex(1)).matrix(), 1e-12));
  EXPECT_TRUE((rig.rig_from_cam(1) * rig.cam_from_rig(CameraIndex(1))).matrix().isApprox(SE3().matrix(), 1e-12));

  ASSERT_TRUE(map.scale_submap(k, 3.0));
  EXPECT_TRUE(map.keyframe(k).twist.tail<3>().isApprox(3.0 * frame->twist.tail<3>()));
  EXPECT_EQ(map.keyframe(k).twist.head<3>(), frame->twist.head<3>());
}

}  // namespace
}  // namespace bslam::map
