#include "tracking/reduced_work.h"

#include <gtest/gtest.h>

namespace bslam::tracking {
namespace {

TEST(ReducedWork, LevelZeroIsAllOfIt) {
  const TrackingOptions tracking = reduced(TrackingOptions(), 0);
  const feature::FeatureOptions features = reduced(feature::FeatureOptions(), 0);
  EXPECT_EQ(features.per_image, feature::FeatureOptions().per_image);
  EXPECT_EQ(features.per_rig, feature::FeatureOptions().per_rig);
  EXPECT_EQ(tracking.direct.per_rig, DirectOptions().per_rig);
  EXPECT_EQ(tracking.keyframe.min_interval, KeyframeOptions().min_interval);
  EXPECT_EQ(tracking.keyframe.min_overlap, KeyframeOptions().min_overlap);
}

TEST(ReducedWork, EveryLevelIsLessThanTheOneBefore) {
  for (int level = 1; level <= kMaxReduction; ++level) {
    const TrackingOptions before = reduced(TrackingOptions(), level - 1), tracking = reduced(TrackingOptions(), level);
    EXPECT_LT(reduced(feature::FeatureOptions(), level).per_rig, reduced(feature::FeatureOptions(), level - 1).per_rig);
    EXPECT_LT(tracking.direct.per_image, before.direct.per_image);
    EXPECT_LT(tracking.direct.min_per_image, before.direct.min_per_image);
    EXPECT_LT(tracking.direct.min_overlap, before.direct.min_overlap);
    EXPECT_LT(tracking.keyframe.min_overlap, before.keyframe.min_overlap);
    EXPECT_GT(tracking.keyframe.min_interval, before.keyframe.min_interval);
    // Fewer keypoints are no reason for a keyframe.
    EXPECT_LT(tracking.keyframe.min_tracked_close, before.keyframe.min_tracked_close);
    // A camera of many is not short of inliers because fewer of its landmarks are aligned.
    EXPECT_LT(tracking.keyframe.min_camera_inliers, tracking.direct.min_per_image);
  }
}

TEST(ReducedWork, AChangeOfTheLevelDoesNotLookLikeALossOfLandmarks) {
  TrackerState state;
  state.references = {{KeyframeId(0), 1, 400, 300, 200}, {KeyframeId(0), 1, 200, 150, 100}};
  state.direct.best_inliers = {300, 150};
  change_level(0, 2, state);
  EXPECT_EQ(state.references[0].best_overlap, 200);
  EXPECT_EQ(state.references[1].best_overlap, 100);
  EXPECT_EQ(state.references[0].best_own_overlap, 150);
  EXPECT_EQ(state.references[0].best_direct_overlap, 100);
  EXPECT_EQ(state.references[1].best_direct_overlap, 50);
  EXPECT_EQ(state.direct.best_inliers, (std::vector<int>{150, 75}));
  change_level(2, 1, state);  // counts will grow by themselves
  EXPECT_EQ(state.references[0].best_overlap, 200);
}

}  // namespace
}  // namespace bslam::tracking
