#include "map/append_map.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "map/rigs_of_map.h"
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

// A map of two keyframes that share a landmark, whose reference is a keypoint of the last camera.
BundledMap pair_map(const std::shared_ptr<const camera::Rig>& rig, std::uint64_t seed) {
  Random random(seed);
  const std::size_t n = rig->size();
  BundledMap map(rig);
  const KeyframeId a = map.add_keyframe(synthetic_frame(random, n, 20, 5), random_pose(random, 1), {}, {});
  const KeyframeId b = map.add_keyframe(synthetic_frame(random, n, 20, 5), random_pose(random, 1), {}, a);
  const frame::KeypointRef last{CameraIndex(n - 1), KeypointIndex(19)};
  const FeatureId f = map.keyframe(a).frame->bundled.feature(last);
  const std::vector<Observation> both = {{a, f}, {b, f}};
  map.add_landmark(random_point(random), both, {a, last});
  return map;
}

std::shared_ptr<const camera::Rig> longer_focal_length(const camera::Rig& rig) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
    cameras.back().camera.model = camera::Pinhole({410, 410, 319.5, 239.5});
  }
  return std::make_shared<const camera::Rig>(std::move(cameras));
}

// Expects that the keyframes from `first` on are those of `other`, in which camera 0 is camera `camera` of `map`.
void expect_appended(const BundledMap& map, KeyframeId first, const BundledMap& other, std::size_t camera) {
  for (const KeyframeId k : other.keyframe_ids()) {
    const frame::BundledFrame &source = *other.keyframe(k).frame,
                              &added = *map.keyframe(KeyframeId(first.index() + k.index())).frame;
    ASSERT_EQ(added.cameras.size(), map.rig().size());
    ASSERT_EQ(added.bundled.size(), source.bundled.size());
    EXPECT_EQ(added.bundled.num_matched(), source.bundled.num_matched());
    for (std::size_t f = 0; f < source.bundled.size(); ++f) {
      const auto before = source.bundled.keypoints(FeatureId(f)), after = added.bundled.keypoints(FeatureId(f));
      ASSERT_EQ(after.size(), before.size());
      for (std::size_t i = 0; i < before.size(); ++i) {
        EXPECT_EQ(after[i].camera.index(), before[i].camera.index() + camera);
        EXPECT_EQ(after[i].keypoint, before[i].keypoint);
      }
    }
    for (std::size_t c = 0; c < source.cameras.size(); ++c)
      EXPECT_TRUE(
          std::ranges::equal(added.cameras[camera + c].keypoints.descriptor, source.cameras[c].keypoints.descriptor));
  }
}

TEST(AppendMap, AppendsTheCamerasOfAnotherRig) {
  const auto rig = synthetic_rig(2), another = longer_focal_length(*synthetic_rig(3));
  BundledMap map = pair_map(rig, 21);
  const BundledMap other = pair_map(another, 22);
  const AppendedIds ids = append_map(map, other);
  EXPECT_EQ(map.check_invariants().value_or("valid"), "valid");
  ASSERT_EQ(map.rig().size(), 5u);
  EXPECT_EQ(map.rig().camera(0).name, "cam0");
  EXPECT_EQ(map.rig().camera(2).name, "cam2");
  EXPECT_EQ(find_rig(map, *rig), 0u);
  EXPECT_EQ(find_rig(map, *another), 2u);
  EXPECT_EQ(first_cameras_of_rigs(map), (std::vector<std::size_t>{0, 0, 2, 2, 2}));
  expect_appended(map, KeyframeId(2), other, 2);
  EXPECT_EQ(map.landmark(ids.landmarks[0]).reference.keypoint.camera, CameraIndex(4));
}

TEST(AppendMap, RecognisesRigsInAnyOrder) {
  const auto rig = synthetic_rig(2), another = longer_focal_length(*synthetic_rig(3));
  BundledMap map = pair_map(rig, 23), other = pair_map(another, 24);
  append_map(map, pair_map(another, 25));
  append_map(other, pair_map(rig, 26));  // its cameras are called cam2 and cam3 here
  append_map(map, other);
  EXPECT_EQ(map.check_invariants().value_or("valid"), "valid");
  EXPECT_EQ(map.rig().size(), 5u);
  EXPECT_EQ(map.num_keyframes(), 8u);
  expect_appended(map, KeyframeId(4), pair_map(another, 24), 2);
  expect_appended(map, KeyframeId(6), pair_map(rig, 26), 0);
}

TEST(AppendMap, UsesTheRefinedCalibrationOfTheMapThatIsContinued) {
  const auto given = synthetic_rig(2), refined = longer_focal_length(*given);
  BundledMap map = pair_map(given, 27);
  map.set_rig(refined);
  const BundledMap other = pair_map(given, 28);
  append_map(map, other);
  ASSERT_EQ(map.rig().size(), 2u);
  const auto bearings = [](const BundledMap& m, std::size_t k) {
    return m.keypoints(KeyframeId(k), CameraIndex(0)).bearing;
  };
  BundledMap expected = other;
  expected.set_rig(refined);
  EXPECT_TRUE(std::ranges::equal(bearings(map, 2), bearings(expected, 0)));
  EXPECT_FALSE(std::ranges::equal(bearings(map, 2), bearings(other, 0)));
}

// `rig` with the rotation of camera 0 that a refined calibration of its principal point has.
std::shared_ptr<const camera::Rig> turned(const camera::Rig& rig, double angle_rad) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
  const geometry::SE3 T_cam0_rig(geometry::so3_exp({0, angle_rad, 0}), geometry::Vector3d::Zero());
  return std::make_shared<const camera::Rig>(std::move(cameras), T_cam0_rig);
}

TEST(AppendMap, ARigWithARefinedCalibrationIsKnown) {
  const auto rig = turned(*synthetic_rig(2), 0.01), refined_again = turned(*rig, 0.015);
  BundledMap map = pair_map(rig, 32);
  EXPECT_EQ(find_rig(map, *rig), 0u);
  EXPECT_FALSE(find_rig(map, *synthetic_rig(2)));
  map.set_rig(refined_again);
  EXPECT_EQ(find_rig(map, *rig), 0u);
  EXPECT_EQ(find_rig(map, *refined_again), 0u);
  for (int run = 0; run < 2; ++run) {
    EXPECT_EQ(find_or_append_rig(map, *refined_again), 0u);
    append_map(map, pair_map(rig, 33));
  }
  EXPECT_EQ(map.rig().size(), 2u);
}

TEST(AppendMap, ARigWithARefinedCalibrationIsKnownInAMapOfSeveralRigs) {
  using Cameras = std::vector<std::optional<std::size_t>>;
  const auto rig = synthetic_rig(2), refined = turned(*rig, 0.01);
  for (const bool refined_first : {false, true}) {
    const auto &first = refined_first ? refined : rig, &second = refined_first ? rig : refined;
    BundledMap map = pair_map(first, 34);
    append_map(map, pair_map(second, 35));
    EXPECT_EQ(find_rig(map, *first), 0u);
    EXPECT_EQ(find_rig(map, *second), 2u);
    EXPECT_EQ(first_cameras_of_rigs(map), (std::vector<std::size_t>{0, 0, 2, 2}));
    EXPECT_EQ(find_cameras(map, longer_focal_length(*rig)->subset(std::vector<int>{0})), Cameras(4));
    append_map(map, pair_map(second, 36));
    append_map(map, pair_map(first, 37));
    EXPECT_EQ(map.rig().size(), 4u);
  }
}

// A camera that is turned about the origin of the rig frame, such as one of a panoramic camera, is no rig of its own,
// even if it never observes anything.
TEST(AppendMap, CamerasOfOneOriginAreOneRig) {
  const auto two = synthetic_rig(2);
  const geometry::SE3 turn(geometry::so3_exp({0, 0.5, 0}), geometry::Vector3d::Zero());
  const auto rig =
      std::make_shared<const camera::Rig>(std::vector<camera::RigCamera>{{two->camera(0), {}}, {two->camera(1), turn}});
  EXPECT_EQ(first_cameras_of_rigs(BundledMap(rig)), (std::vector<std::size_t>{0, 0}));
}

// A rig whose second camera turned during the recording of its map.
BundledMap map_with_move(const std::shared_ptr<const camera::Rig>& rig, std::uint64_t seed) {
  BundledMap map = pair_map(rig, seed);
  const geometry::SE3 turn(geometry::so3_exp({0, 0.01, 0}), {0.001, 0, 0});
  map.set_rig(std::make_shared<const camera::Rig>(rig->with_moves({{1, 100, turn}})));
  return map;
}

TEST(AppendMap, ARigThatMovedIsKnownByItsExtrinsicsBeforeAndAfter) {
  const auto rig = synthetic_rig(2);
  const BundledMap map = map_with_move(rig, 29);
  const camera::Rig after = map.rig().after_moves();
  EXPECT_EQ(find_rig(map, *rig), 0u);
  EXPECT_EQ(find_rig(map, after), 0u);
  for (const camera::Rig& given : {*rig, after}) {
    BundledMap continued = map;  // with the rig as it is now
    ASSERT_EQ(find_or_append_rig(continued, given), 2u);
    EXPECT_EQ(continued.rig().size(), 4u);
    EXPECT_LT((continued.rig().cam_from_rig(3).matrix() - after.cam_from_rig(1).matrix()).norm(), 1e-12);
    ASSERT_EQ(continued.rig().moves().size(), 1u);
    EXPECT_EQ(continued.rig().moves()[0].camera, 1u);
    EXPECT_EQ(find_rig(continued, given), 2u);  // no further one for the next run
  }
}

// The moves of one recording do not apply to another one.
TEST(AppendMap, MapsOfARigThatMovedKeepTheirExtrinsics) {
  const auto rig = synthetic_rig(2);
  for (const bool moved_first : {false, true}) {
    BundledMap map = moved_first ? map_with_move(rig, 30) : pair_map(rig, 30);
    append_map(map, moved_first ? pair_map(rig, 31) : map_with_move(rig, 31));
    EXPECT_EQ(map.check_invariants().value_or("valid"), "valid");
    ASSERT_EQ(map.rig().size(), 4u);
    ASSERT_EQ(map.rig().moves().size(), 1u);
    EXPECT_EQ(map.rig().moves()[0].camera, moved_first ? 1u : 3u);
  }
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
