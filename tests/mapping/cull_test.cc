#include "mapping/cull.h"

#include <gtest/gtest.h>

#include "map/synthetic_map.h"

namespace bslam::mapping {
namespace {

// Keyframes of two cameras with `matched` two-camera features followed by monocular ones; no geometry.
class Cull : public ::testing::Test {
 protected:
  static constexpr std::size_t kKeypoints = 60, kMatched = 20;
  Cull() : map(map::synthetic_rig(2)) {}
  KeyframeId add_keyframe(bool camera_1 = true) {
    auto frame = std::make_shared<frame::BundledFrame>(*map::synthetic_frame(random, 2, kKeypoints, kMatched));
    if (!camera_1) frame->cameras[1].keypoints = {};
    return map.add_keyframe(frame, map::random_pose(random, 0.5), {}, map.newest_keyframe());
  }
  LandmarkId add_landmark(const std::vector<map::Observation>& observations) {
    return map.add_landmark(map::random_point(random), observations);
  }
  map::MapDraft draft() const { return map::MapDraft(std::make_shared<const map::BundledMap>(map)); }
  // Culls the landmarks and returns the number of those removed.
  std::size_t culled_landmarks(KeyframeId newest, map::MapDraft& d) const {
    const std::size_t before = d.map().num_landmarks();
    cull_landmarks(newest, options, d);
    return before - d.map().num_landmarks();
  }
  static FeatureId monocular(int i) { return FeatureId(static_cast<std::int32_t>(kMatched) + i); }
  // The last feature of the newest keyframe.
  FeatureId of_camera_1() const {
    return FeatureId(static_cast<std::int32_t>(map.keyframe(map.newest_keyframe()).frame->bundled.size()) - 1);
  }

  Random random{1, "cull"};
  map::BundledMap map;
  const CullingOptions options;
};

TEST_F(Cull, RemovesLandmarksThatTrackingRarelyMatches) {
  const KeyframeId k = add_keyframe();
  const LandmarkId found = add_landmark({{k, FeatureId(0)}}), missed = add_landmark({{k, FeatureId(1)}}),
                   rarely_expected = add_landmark({{k, FeatureId(2)}});
  map.add_visibility_counts(found, 8, 2);
  map.add_visibility_counts(missed, 8, 1);
  map.add_visibility_counts(rarely_expected, 3, 0);
  map::MapDraft d = draft();
  EXPECT_EQ(culled_landmarks(k, d), 1u);
  EXPECT_TRUE(d.map().alive(found) && d.map().alive(rarely_expected));
  EXPECT_FALSE(d.map().alive(missed));
}

TEST_F(Cull, RequiresThreeKeypointsAfterTheProbation) {
  const KeyframeId k0 = add_keyframe();
  const LandmarkId two = add_landmark({{k0, FeatureId(0)}}), one = add_landmark({{k0, monocular(0)}});
  const KeyframeId k1 = add_keyframe();
  map.add_observation(two, {k1, monocular(1)});  // now it has three keypoints
  for (int age = 1; age <= 3; ++age) {
    map::MapDraft d = draft();
    const KeyframeId newest = map.newest_keyframe();
    EXPECT_EQ(culled_landmarks(newest, d), newest.value() >= options.probation ? 1u : 0u);
    EXPECT_EQ(d.map().alive(one), newest.value() < options.probation);
    EXPECT_TRUE(d.map().alive(two));
    add_keyframe();
  }
}

TEST_F(Cull, KeepsLandmarksOlderThanTheProbation) {
  const KeyframeId k = add_keyframe();
  const LandmarkId old = add_landmark({{k, monocular(0)}});
  map.add_visibility_counts(old, 100, 0);
  for (int i = 0; i < 5; ++i) add_keyframe();
  map::MapDraft d = draft();
  EXPECT_EQ(culled_landmarks(map.newest_keyframe(), d), 0u);
  EXPECT_TRUE(d.map().alive(old));
}

// Camera 1 has an image in every third keyframe only, as one with a lower rate.
TEST_F(Cull, ProbationCountsKeyframesWithImagesOfTheCamera) {
  const KeyframeId k = add_keyframe();
  const LandmarkId of_0 = add_landmark({{k, monocular(0)}}), of_1 = add_landmark({{k, of_camera_1()}});
  ASSERT_EQ(map.landmark(of_1).reference.keypoint.camera, CameraIndex(1));
  for (int age = 1; age <= 9; ++age) {
    add_keyframe(/*camera_1=*/age % 3 == 0);
    map::MapDraft d = draft();
    cull_landmarks(map.newest_keyframe(), options, d);
    EXPECT_EQ(d.map().alive(of_0), age != 3) << age;
    EXPECT_EQ(d.map().alive(of_1), age != 9) << age;
  }
}

// The removed keyframe counts as if it had an image of camera 1, so that two more have one from one keyframe to the
// next.
TEST_F(Cull, ProbationEndsAlthoughAKeyframeWasRemoved) {
  const KeyframeId k = add_keyframe();
  const LandmarkId of_1 = add_landmark({{k, of_camera_1()}});
  for (int age = 1; age <= 4 * options.probation; ++age) {
    add_keyframe(/*camera_1=*/age % 3 == 0);
    if (age == 9) map.remove_keyframe(KeyframeId(4));
    map::MapDraft d = draft();
    cull_landmarks(map.newest_keyframe(), options, d);
    EXPECT_EQ(d.map().alive(of_1), age < 4 * options.probation) << age;
  }
}

// A camera that has failed.
TEST_F(Cull, ProbationEndsWithoutFurtherImages) {
  const KeyframeId k = add_keyframe();
  const LandmarkId of_1 = add_landmark({{k, of_camera_1()}});
  for (int age = 1; age <= 4 * options.probation; ++age) {
    add_keyframe(/*camera_1=*/false);
    map::MapDraft d = draft();
    cull_landmarks(map.newest_keyframe(), options, d);
    EXPECT_EQ(d.map().alive(of_1), age < 4 * options.probation) << age;
  }
}

// Keyframes 0 ... 5 all observe the same landmarks on the same levels.
class CullKeyframes : public Cull {
 protected:
  CullKeyframes() {
    for (int k = 0; k < 6; ++k) {
      auto frame = std::make_shared<frame::BundledFrame>(*map::synthetic_frame(random, 2, kKeypoints, kMatched));
      for (frame::CameraFrame& c : frame->cameras) c.keypoints.level = std::vector<std::uint8_t>(c.keypoints.size(), 2);
      map.add_keyframe(frame, map::random_pose(random, 0.5), {}, map.newest_keyframe());
    }
    for (int l = 0; l < 40; ++l) {
      std::vector<map::Observation> observations;
      for (int k = 0; k < 6; ++k) observations.push_back({KeyframeId(k), FeatureId(l)});
      add_landmark(observations);
    }
  }
  std::vector<int> culled(const CullingOptions& o) const {
    map::MapDraft d = draft();
    cull_keyframes(KeyframeId(5), o, d);
    std::vector<int> removed;
    for (int k = 0; k < 6; ++k) {
      if (!d.map().alive(KeyframeId(k))) removed.push_back(k);
    }
    EXPECT_EQ(map.num_keyframes() - d.map().num_keyframes(), removed.size());
    EXPECT_EQ(d.map().check_invariants(), std::nullopt);
    return removed;
  }
};

TEST_F(CullKeyframes, RemovesRedundantOnesExceptTheRootAndTheNewest) {
  EXPECT_EQ(culled(options), (std::vector<int>{1, 2}));
}

TEST_F(CullKeyframes, StopsWhenTheOthersAreNoLongerRedundant) {
  CullingOptions five;
  five.redundant_views = 5;  // after one is removed, no landmark is observed by five others
  EXPECT_EQ(culled(five), (std::vector<int>{1}));
}

TEST_F(CullKeyframes, KeepsAKeyframeWithOwnLandmarks) {
  // 40 of 46 are observed elsewhere: 87 %
  for (int l = 0; l < 6; ++l) add_landmark({{KeyframeId(1), FeatureId(50 + l)}});
  EXPECT_EQ(culled(options), (std::vector<int>{2}));
}

TEST_F(CullKeyframes, CoarseObservationsDoNotMakeAFineOneRedundant) {
  const auto coarse = [&](int k) {
    for (frame::CameraFrame& c : const_cast<frame::BundledFrame&>(*map.keyframe(KeyframeId(k)).frame).cameras) {
      c.keypoints.level = std::vector<std::uint8_t>(c.keypoints.size(), 6);
    }
  };
  for (const int k : {2, 3, 4, 5}) coarse(k);
  EXPECT_EQ(culled(options), (std::vector<int>{2}));  // only keyframe 1 and the root observe the landmarks on level 2
}

}  // namespace
}  // namespace bslam::mapping
