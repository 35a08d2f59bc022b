#include "tracking/landmark_support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

// Landmarks of the scene by the time for which keyframes observed them.
class LastingLandmarks : public ::testing::Test {
 protected:
  LastingLandmarks() {
    ThreadPool pool(2);
    MatchSearch search =
        find_landmarks(world.map, seen.frame, truth, world.map.landmark_ids(), {}, {.radius = 0.02}, pool);
    visible = std::move(search.visible);
    matches = std::move(search.found);
  }

  bool is_lasting(const Match& m) const { return is_lasting(m.landmark); }
  bool is_lasting(LandmarkId l) const {
    const auto of = world.map.observations(l);
    const auto time_ns = [&](const map::Observation& o) { return world.map.keyframe(o.keyframe).frame->time_ns; };
    return to_seconds(time_ns(of.back()) - time_ns(of.front())) >= 0.5;
  }

  std::vector<std::uint8_t> inliers(const std::function<bool(const Match&)>& is_inlier) const {
    std::vector<std::uint8_t> out;
    for (const auto& camera : matches) {
      for (const Match& m : camera) out.push_back(is_inlier(m));
    }
    return out;
  }

  map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 1.0, 0.25);
  synthetic::SimulatedFrame seen = world.sim.frame(FrameId(1), 0.1);
  geometry::SE3 truth = seen.T_world_rig.inverse();
  std::vector<LandmarkId> visible;
  FrameMatches matches;
};

// A landmark that one keyframe observes is confirmed by frames in which it is found.
TEST_F(LastingLandmarks, AndThoseFoundInSeveralFramesAreConfirmed) {
  const auto observations = [&](const Match& m) { return world.map.observations(m.landmark).size(); };
  const auto by_keyframes = inliers([&](const Match& m) { return observations(m) > 1; });
  EXPECT_GT(std::ranges::count(by_keyframes, std::uint8_t{1}), 20);
  EXPECT_GT(std::ranges::count(by_keyframes, std::uint8_t{0}), 20);
  EXPECT_EQ(confirmed_landmarks(world.map, TrackerState(), matches), by_keyframes);
  TrackerState state;
  std::vector<map::VisibilityCount>& recent = state.visibility_counts;
  for (const LandmarkId l : world.map.landmark_ids()) recent.push_back({l, 6, l.value() % 2 == 0 ? 2u : 1u});
  EXPECT_EQ(confirmed_landmarks(world.map, state, matches),
            inliers([&](const Match& m) { return observations(m) > 1 || m.landmark.value() % 2 == 0; }));
  for (map::VisibilityCount& counts : recent) counts.expected = 7;
  EXPECT_EQ(confirmed_landmarks(world.map, state, matches), by_keyframes);
  for (map::VisibilityCount& counts : recent) counts.expected = counts.found = 1;
  EXPECT_EQ(confirmed_landmarks(world.map, state, matches), by_keyframes);
  state.pending_counts = recent;
  EXPECT_EQ(confirmed_landmarks(world.map, state, matches), inliers([](const Match&) { return true; }));
}

TEST_F(LastingLandmarks, CountMoreInCellsWithConfirmedOnes) {
  const auto observed = pose_observations(world.map, seen.frame, matches, {.sigma_px = 0.7, .pyramid = {}});
  const std::vector<std::uint8_t> all(observed.size(), 1), none(observed.size(), 0);
  const LandmarkSupport unknown = support(world.map, matches, observed, all);
  EXPECT_EQ(support(world.map, matches, observed, all, all).sum(), unknown.sum());
  const LandmarkSupport unconfirmed = support(world.map, matches, observed, all, none);
  EXPECT_NEAR(unconfirmed.spread, 0.2 * unknown.spread, 1e-9);
  EXPECT_EQ(unconfirmed.lasting, unknown.lasting);
  std::vector<std::uint8_t> one = none;
  one[0] = 1;
  EXPECT_NEAR(support(world.map, matches, observed, all, one).spread, unconfirmed.spread + 0.4, 1e-9);
}

TEST_F(LastingLandmarks, AreFoundLikeOthersWhereNothingMoves) {
  EXPECT_TRUE(lasting_landmarks_found(world.map, visible, matches, inliers([](const Match&) { return true; })));
  int k = 0;  // of noise, few of both are found
  EXPECT_TRUE(
      lasting_landmarks_found(world.map, visible, matches, inliers([&](const Match&) { return k++ % 8 == 0; })));
}

TEST_F(LastingLandmarks, AreMissedWhereThePoseIsThatOfMovingObjects) {
  int k = 0;
  const auto moving = inliers([&](const Match& m) { return !is_lasting(m) || k++ % 100 == 0; });
  EXPECT_FALSE(lasting_landmarks_found(world.map, visible, matches, moving));
}

TEST_F(LastingLandmarks, TellNothingIfFewAreVisible) {
  std::erase_if(visible, [&](LandmarkId l) { return is_lasting(l) && l.value() % 128 != 0; });
  EXPECT_TRUE(
      lasting_landmarks_found(world.map, visible, matches, inliers([&](const Match& m) { return !is_lasting(m); })));
}

}  // namespace
}  // namespace bslam::tracking
