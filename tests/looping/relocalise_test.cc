#include "looping/relocalise.h"

#include <gtest/gtest.h>

#include "simulated_hall.h"

namespace bslam::looping {
namespace {

std::optional<PlaceMatch> relocalised(PlaceRecogniser& places, const HallMap& world, const SimulatedFrame& seen,
                                      std::uint64_t seed) {
  return relocalise(
      places, world.map, described(seen), [](const PlaceMatch&) { return true; }, {}, kFeatures, seeded(seed));
}
std::optional<PlaceMatch> relocalised(const HallMap& world, const SimulatedFrame& seen) {
  return relocalised(*recogniser(), world, seen, 1);
}

bool is_true(const PlaceMatch& place_match, const SE3& T_rig_world) {
  return distance_m(place_match.T_rig_world, T_rig_world) < 0.03 &&
         angle_rad(place_match.T_rig_world, T_rig_world) < 0.5 * kDegree;
}

TEST(Relocalise, FindsThePoseFromAnySubsetOfTheCameras) {
  const HallMap& world = map_without_drift(4);
  const FeatureSimulator simulator = hall(rig_of(4));
  for (int present = 1; present < 16; ++present) {
    std::vector<int> missing;
    for (int c = 0; c < 4; ++c) {
      if ((present >> c & 1) == 0) missing.push_back(c);
    }
    const SimulatedFrame seen = simulator.frame(FrameId(1000), kStepS * 12 + 0.4, missing);
    const auto place_match = relocalised(world, seen);
    ASSERT_TRUE(place_match) << "cameras " << present;
    EXPECT_TRUE(is_true(*place_match, seen.T_world_rig.inverse())) << "cameras " << present;
  }
}

TEST(Relocalise, FindsThePoseInTheOppositeViewingDirection) {
  const HallMap& world = map_without_drift(4);
  const SimulatedFrame seen = hall(rig_of(4), std::numbers::pi).frame(FrameId(1000), kStepS * 12 + 0.4);
  const auto place_match = relocalised(world, seen);
  ASSERT_TRUE(place_match);
  EXPECT_TRUE(is_true(*place_match, seen.T_world_rig.inverse()));
}

// Frames of the hall, and of halls in which most or all landmarks look different; various rigs.
class RelocaliseRig : public ::testing::TestWithParam<int> {};

TEST_P(RelocaliseRig, NeverReturnsAWrongPose) {
  const int cameras = GetParam();
  const HallMap& world = map_without_drift(cameras);
  const FeatureSimulator simulator = hall(rig_of(cameras));
  const auto places = recogniser();
  int found = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Random random(seed, "frames");
    const double time_s = random.uniform(0, kStepS * (2 * kLapKeyframes / 3 - 1));
    std::vector<int> missing;
    for (int c = 1; c < cameras; ++c) {
      if (random.uniform() < 0.4) missing.push_back(c);
    }
    const SimulatedFrame seen = simulator.frame(FrameId(1000 + static_cast<int>(seed)), time_s, missing);
    if (const auto place_match = relocalised(*places, world, seen, seed)) {
      ++found;
      EXPECT_TRUE(is_true(*place_match, seen.T_world_rig.inverse())) << "seed " << seed;
    }
    EXPECT_FALSE(relocalised(*places, world, redecorated(seen, 1.0, seed), seed)) << "seed " << seed;
    EXPECT_FALSE(relocalised(*places, world, redecorated(seen, 0.875, seed), seed)) << "seed " << seed;
  }
  EXPECT_GE(found, 48);
}

INSTANTIATE_TEST_SUITE_P(Cameras, RelocaliseRig, ::testing::Values(1, 2, 4));

// A map of two rooms 30 m apart; in the second one, `fraction` of the landmarks look different.
HallMap two_rooms(const FeatureSimulator& simulator, double fraction) {
  HallMap world(simulator.rig());
  const SE3 next_door(Eigen::Quaterniond::Identity(), {30, 0, 0});
  for (int i = 0; i < 8; ++i) world.add(simulator.frame(FrameId(i), kStepS * i));
  for (int i = 8; i < 16; ++i)
    world.add(redecorated(simulator.frame(FrameId(i), kStepS * (i - 8)), fraction, 1), {}, 1, next_door);
  return world;
}

TEST(Relocalise, RejectsAmbiguousRooms) {
  for (const int cameras : {1, 2, 4}) {
    const FeatureSimulator simulator = hall(rig_of(cameras));
    const HallMap world = two_rooms(simulator, 0.0);
    const auto places = recogniser();
    for (int i = 0; i < 10; ++i) {
      const SimulatedFrame seen = simulator.frame(FrameId(1000 + i), 1 + 0.4 * i);
      EXPECT_FALSE(relocalised(*places, world, seen, static_cast<std::uint64_t>(i)));
    }
  }
}

// Of two identical rooms, the one that the rig cannot have reached is no alternative.
TEST(Relocalise, DistinguishesAmbiguousRoomsIfOneIsNotPlausible) {
  const FeatureSimulator simulator = hall(rig_of(2));
  const HallMap world = two_rooms(simulator, 0.0);
  const auto places = recogniser();
  int found = 0;
  for (int i = 0; i < 10; ++i) {
    const SimulatedFrame seen = simulator.frame(FrameId(1000 + i), 1 + 0.4 * i);
    const auto is_here = [&](const PlaceMatch& place) { return is_true(place, seen.T_world_rig.inverse()); };
    const auto place = relocalise(*places, world.map, described(seen), is_here, {}, kFeatures, seeded(1));
    if (!place) continue;
    ++found;
    EXPECT_TRUE(is_here(*place));
    EXPECT_GT(place->found_ratio, VerificationOptions{}.min_found_ratio);
    EXPECT_LE(place->found_ratio, 1.0);
  }
  EXPECT_GE(found, 8);
}

TEST(Relocalise, DistinguishesRoomsThatDifferInHalfOfTheirLandmarks) {
  for (const int cameras : {1, 2, 4}) {
    const FeatureSimulator simulator = hall(rig_of(cameras));
    const HallMap world = two_rooms(simulator, 0.5);
    const auto places = recogniser();
    int found = 0;
    for (int i = 0; i < 10; ++i) {
      const SimulatedFrame seen = simulator.frame(FrameId(1000 + i), 1 + 0.4 * i);
      const auto place_match = relocalised(*places, world, seen, static_cast<std::uint64_t>(i));
      if (!place_match) continue;
      ++found;
      EXPECT_TRUE(is_true(*place_match, seen.T_world_rig.inverse()));
    }
    EXPECT_GE(found, 8);
  }
}

TEST(Relocalise, FindsFramesInEverySubmap) {
  const FeatureSimulator simulator = hall(rig_of(2));
  HallMap world(simulator.rig());
  for (int i = 0; i < 6; ++i) world.add(simulator.frame(FrameId(i), kStepS * i));
  for (int i = 6; i < 12; ++i) world.add(simulator.frame(FrameId(i), 20 + kStepS * i), {}, 0, {}, i == 6);
  for (const double time_s : {2.5, 28.5}) {
    const SimulatedFrame seen = simulator.frame(FrameId(1000), time_s);
    const auto place_match = relocalised(world, seen);
    ASSERT_TRUE(place_match);
    EXPECT_EQ(world.map.root_of(place_match->matched_keyframe), time_s < 10 ? KeyframeId(0) : KeyframeId(6));
    EXPECT_TRUE(is_true(*place_match, seen.T_world_rig.inverse()));
  }
}

TEST(Relocalise, IsDeterministicForASeed) {
  const HallMap& world = map_without_drift(2);
  const SimulatedFrame seen = hall(rig_of(2)).frame(FrameId(1000), 7.3);
  const auto a = relocalised(world, seen), b = relocalised(world, seen);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->T_rig_world.translation(), b->T_rig_world.translation());
  EXPECT_EQ(a->matches, b->matches);
}

}  // namespace
}  // namespace bslam::looping
