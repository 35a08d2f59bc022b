#include "tracking/stereo_scale.h"

#include <gtest/gtest.h>

#include "tracking/camera_consensus.h"
#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

constexpr double kTime_s = 0.2;  // of the frame

// A map of wrong size, and a frame of its rig with the matches that are right.
struct Case {
  map::SimulatedMap world;
  frame::BundledFrame frame;
  FrameMatches matches;
  geometry::SE3 T_rig_world;

  std::optional<double> found() const {
    const auto scale = stereo_scale(world.map, frame, matches, T_rig_world, {});
    return scale ? std::optional(scale->factor) : std::nullopt;
  }
};

// A rig of two cameras. `single`: only camera `first` had images before the frame. `size`: of the map, relative to the
// truth.
Case make_case(bool single, double size, std::size_t first = 0) {
  const InitialisationOptions options;
  map::SimulatedMap world(simulator(synthetic::ring_rig(2)));
  world.change_frame = [&](frame::BundledFrame& frame) {
    if (single) remove_camera(world.sim.rig(), 1 - first, options.min_parallax, options.max_chi2, frame);
  };
  for (int i = 0; i < 2; ++i) world.add_keyframe(FrameId(1000 + i), 0.1 * i, /*all=*/single);
  const auto seen = world.sim.frame(FrameId(0), kTime_s);
  const geometry::SE3 T_rig_root = seen.T_world_rig.inverse() * world.frames[0].T_world_rig;
  FrameMatches matches(2);
  for (std::size_t c = 0; c < matches.size(); ++c) {
    for (std::size_t k = 0; k < seen.landmark[c].size(); ++k) {
      const auto l = world.landmark_of.find(seen.landmark[c][k]);
      if (l != world.landmark_of.end()) matches[c].push_back({KeypointIndex(k), l->second});
    }
  }
  world.map.set_scale(map::Scale::kUnobservable);
  world.map.scale_submap(KeyframeId(0), size);
  const geometry::SE3 T_rig_world = geometry::scaled(T_rig_root, size) * world.map.keyframe(KeyframeId(0)).T_rig_world;
  world.change_frame = nullptr;
  return {std::move(world), seen.frame, std::move(matches), T_rig_world};
}

TEST(StereoScale, IsFoundWhenAnOverlappingCameraJoins) {
  for (const double size : {0.5, 0.8, 1.4, 3.0}) {
    for (const std::size_t first : {0, 1}) {
      const auto found = make_case(true, size, first).found();
      ASSERT_TRUE(found.has_value()) << size;
      EXPECT_NEAR(*found * size, 1.0, 0.06) << size << ", camera " << first;
    }
  }
}

TEST(StereoScale, ChangesNothingIfTheMapHasTheRightScale) {
  EXPECT_EQ(make_case(true, 1.0).found(), std::nullopt);
  EXPECT_EQ(make_case(true, 1.05).found(), std::nullopt) << "adjustment corrects small errors";
}

// Landmarks of several cameras have the size of the baseline, whatever the size of the map.
TEST(StereoScale, IsNotFoundFromLandmarksThatSeveralCamerasCreated) {
  EXPECT_EQ(make_case(false, 1.4).found(), std::nullopt);
}

TEST(StereoScale, ThatIsKnownIsNotChanged) {
  for (const map::Scale scale : {map::Scale::kMetric, map::Scale::kUpToScale}) {
    Case wrong = make_case(true, 1.4);
    wrong.world.map.set_scale(scale);
    EXPECT_EQ(wrong.found(), std::nullopt);
  }
}

TEST(StereoScale, NeedsSeveralFeatures) {
  Case few = make_case(true, 1.4);
  few.matches[0].resize(10);
  EXPECT_EQ(few.found(), std::nullopt);
}

}  // namespace
}  // namespace bslam::tracking
