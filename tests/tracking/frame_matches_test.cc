#include "tracking/frame_matches.h"

#include <gtest/gtest.h>

#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

class FindLandmarks : public ::testing::Test {
 protected:
  static constexpr double kRadius = 0.02;  // radians
  map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 0.0, 1.0);
  synthetic::SimulatedFrame seen = world.sim.frame(FrameId(1), 0.1);
  std::vector<LandmarkId> all = world.map.landmark_ids();
  ThreadPool pool{2};
  MatchSearch find(const FrameMatches& known) {
    return find_landmarks(world.map, seen.frame, seen.T_world_rig.inverse(), all, known, {.radius = kRadius}, pool);
  }
  // For keypoints that show a landmark of the map: number of correct matches and of possible matches.
  std::pair<std::size_t, std::size_t> right(const FrameMatches& found) const {
    std::size_t right = 0, possible = 0;
    for (std::size_t c = 0; c < found.size(); ++c) {
      for (const Match& m : found[c])
        right += world.truth_of_landmark.at(m.landmark.value()) == seen.landmark[c][m.keypoint.index()];
      for (const int truth : seen.landmark[c]) possible += truth >= 0 && world.landmark_of.contains(truth);
    }
    return {right, possible};
  }
};

TEST_F(FindLandmarks, FindsNearlyAllLandmarksWithFewErrors) {
  const MatchSearch search = find({});
  ASSERT_EQ(search.found.size(), 4u);
  const auto [good, possible] = right(search.found);
  EXPECT_GT(static_cast<double>(good), 0.9 * static_cast<double>(possible));
  EXPECT_LE(count(search.found) - good, count(search.found) / 100);
}

TEST_F(FindLandmarks, ListsEachExpectedLandmarkOnceAndInOrder) {
  const MatchSearch search = find({});
  EXPECT_TRUE(std::is_sorted(search.visible.begin(), search.visible.end()));
  EXPECT_EQ(std::adjacent_find(search.visible.begin(), search.visible.end()), search.visible.end());
  for (const LandmarkId l : landmarks_of(search.found))
    EXPECT_TRUE(std::binary_search(search.visible.begin(), search.visible.end(), l));
}

TEST_F(FindLandmarks, SkipsKnownMatchesPerCamera) {
  const MatchSearch first = find({});
  FrameMatches known = first.found;
  known[1].clear();
  const MatchSearch again = find(known);
  EXPECT_EQ(again.found[1].size(), first.found[1].size());
  for (const std::size_t c : {0u, 2u, 3u}) {
    for (const Match& m : again.found[c]) {
      for (const Match& k : known[c]) EXPECT_TRUE(m.keypoint != k.keypoint && m.landmark != k.landmark);
    }
  }
  const FrameMatches both = merge(known, again.found);
  EXPECT_EQ(count(both), count(known) + count(again.found));
  for (const auto& camera : both) {
    EXPECT_TRUE(std::is_sorted(camera.begin(), camera.end(),
                               [](const Match& a, const Match& b) { return a.keypoint < b.keypoint; }));
  }
}

TEST_F(FindLandmarks, ACameraWithoutImageFindsNothing) {
  const std::vector<int> missing = {2};
  seen = world.sim.frame(FrameId(1), 0.1, missing);
  const MatchSearch search = find({});
  EXPECT_TRUE(search.found[2].empty());
  EXPECT_FALSE(search.found[0].empty());
}

TEST_F(FindLandmarks, KeypointsThatCannotBeAlignedKeepTheirPositionAndDetectorNoise) {
  MatchSearch search = find({});
  const feature::Keypoints& keypoints = seen.frame.cameras[0].keypoints;
  const AlignedMatches aligned =
      align_matches(world.map, seen.frame, seen.T_world_rig.inverse(), search.found, map::flat_pyramids(4),
                    std::vector<matching::AlignmentOptions>(4), {.sigma_px = 0.9, .pyramid = {}}, pool);
  ASSERT_EQ(aligned[0].size(), search.found[0].size());
  for (std::size_t i = 0; i < aligned[0].size(); ++i) {
    const std::size_t k = search.found[0][i].keypoint.index();
    EXPECT_EQ(aligned[0][i].pixel, keypoints.pixel[k]);
    EXPECT_FALSE(search.found[0][i].aligned);
    EXPECT_NEAR(aligned[0][i].sigma, 0.9 * std::pow(1.2, keypoints.level[k]), 1e-4);
  }
}

// Outliers keep their position, the input frame is unchanged, and unchanged data is shared.
TEST_F(FindLandmarks, RefinedFrameHasInliersAtAlignedPositions) {
  const FrameMatches found = find({}).found;
  AlignedMatches aligned(found.size());
  std::vector<std::uint8_t> inlier;
  for (std::size_t c = 0; c < found.size(); ++c) {
    for (std::size_t i = 0; i < found[c].size(); ++i) {
      aligned[c].push_back({{static_cast<float>(i), 7.0f}, Eigen::Vector3d::UnitX(), 0.11f});
      inlier.push_back(i % 2 == 0);
    }
  }
  const feature::Refinement before = seen.frame.cameras[0].keypoints.positions();
  const frame::BundledFrame frame = refined(seen.frame, found, aligned, inlier, world.map.rig());
  const feature::Keypoints &then = seen.frame.cameras[0].keypoints, &now = frame.cameras[0].keypoints;
  EXPECT_EQ(then.pixel.copy(), before.pixel);
  EXPECT_EQ(then.descriptor.data(), now.descriptor.data());
  std::vector<std::uint8_t> moved(now.size(), 0);
  for (std::size_t i = 0; i < found[0].size(); i += 2) {
    const std::size_t k = found[0][i].keypoint.index();
    moved[k] = 1;
    EXPECT_EQ(now.pixel[k], aligned[0][i].pixel);
    EXPECT_EQ(now.bearing[k], aligned[0][i].bearing);
    EXPECT_EQ(now.sigma[k], aligned[0][i].sigma);
    std::vector<std::uint32_t> near;
    frame.cameras[0].grid.near(now, now.pixel[k].cast<double>(), 0.5, 0, 7, near);
    EXPECT_TRUE(std::ranges::find(near, static_cast<std::uint32_t>(k)) != near.end());
  }
  for (std::size_t k = 0; k < now.size(); ++k) EXPECT_TRUE(moved[k] || now.pixel[k] == then.pixel[k]);
}

TEST_F(FindLandmarks, ObservationsFollowTheOrderOfTheMatches) {
  const MatchSearch search = find({});
  const auto observations = pose_observations(world.map, seen.frame, search.found, {});
  ASSERT_EQ(observations.size(), count(search.found));
  std::size_t i = 0;
  std::vector<std::uint8_t> every_third;
  for (std::size_t c = 0; c < search.found.size(); ++c) {
    for (const Match& m : search.found[c]) {
      EXPECT_EQ(observations[i].camera, CameraIndex(c));
      EXPECT_EQ(observations[i].point_world, world.map.landmark(m.landmark).position);
      EXPECT_EQ(observations[i].pixel, seen.frame.cameras[c].keypoints.pixel[m.keypoint.index()].cast<double>());
      every_third.push_back(i++ % 3 == 0);
    }
  }
  const FrameMatches kept = keep_inliers(search.found, every_third);
  EXPECT_EQ(count(kept), (observations.size() + 2) / 3);
  EXPECT_EQ(kept[0][1].keypoint, search.found[0][3].keypoint);
}

}  // namespace
}  // namespace bslam::tracking
