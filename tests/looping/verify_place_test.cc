// Geometric verification: the true place gives the pose, any other place a reason for its rejection.
#include "looping/verify_place.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "simulated_hall.h"

namespace bslam::looping {
namespace {

// maximum errors in metres and radians, for noise of 0.7 px on 100 keypoints
constexpr double kMaxDistance = 0.006, kMaxAngle = 0.1 * kDegree;

void expect_true_pose(const PlaceMatch& place_match, const SE3& T_rig_world, double metres = kMaxDistance) {
  EXPECT_LT(distance_m(place_match.T_rig_world, T_rig_world), metres);
  EXPECT_LT(angle_rad(place_match.T_rig_world, T_rig_world), kMaxAngle);
}

class VerifyPlaceRig : public ::testing::TestWithParam<int> {};

TEST_P(VerifyPlaceRig, FindsThePoseOfAFrameTakenNearTheCandidate) {
  const HallMap& world = map_without_drift(GetParam());
  const FeatureSimulator simulator = hall(rig_of(GetParam()));
  for (const int at : {3, 11, 25}) {
    const SimulatedFrame seen = simulator.frame(FrameId(1000 + at), kStepS * at + 0.4);
    VerificationReport report;
    const auto place_match =
        verify_place(world.map, world.map.rig(), seen.frame, KeyframeId(at), {}, kFeatures, seeded(1), &report);
    ASSERT_TRUE(place_match) << "rejected for " << static_cast<int>(report.rejection);
    EXPECT_EQ(report.rejection, Rejection::kNone);
    EXPECT_EQ(place_match->matched_keyframe, KeyframeId(at));
    EXPECT_EQ(place_match->inliers, report.inliers);
    EXPECT_GT(place_match->inliers, 100);
    expect_true_pose(*place_match, seen.T_world_rig.inverse());
  }
}

TEST_P(VerifyPlaceRig, MatchesAreDistinctAndCorrect) {
  const HallMap& world = map_without_drift(GetParam());
  const SimulatedFrame seen = hall(rig_of(GetParam())).frame(FrameId(1000), kStepS * 8 + 0.5);
  const auto place_match =
      verify_place(world.map, world.map.rig(), seen.frame, KeyframeId(8), {}, kFeatures, seeded(1));
  ASSERT_TRUE(place_match);
  std::set<FeatureId> features;
  std::set<LandmarkId> landmarks;
  int wrong = 0;
  for (const auto& [feature, l] : place_match->matches) {
    EXPECT_TRUE(features.insert(feature).second && landmarks.insert(l).second);
    wrong += map::shown_by(seen, feature) != world.shown_by_landmark[l.index()].second;
  }
  EXPECT_TRUE(std::is_sorted(place_match->matches.begin(), place_match->matches.end()));
  EXPECT_LE(wrong, static_cast<int>(place_match->matches.size() / 100));
}

TEST_P(VerifyPlaceRig, IsDeterministicForASeed) {
  const HallMap& world = map_without_drift(GetParam());
  const SimulatedFrame seen = hall(rig_of(GetParam())).frame(FrameId(1000), kStepS * 8 + 0.5);
  const auto a = verify_place(world.map, world.map.rig(), seen.frame, KeyframeId(8), {}, kFeatures, seeded(3));
  const auto b = verify_place(world.map, world.map.rig(), seen.frame, KeyframeId(8), {}, kFeatures, seeded(3));
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->T_rig_world.translation(), b->T_rig_world.translation());
  EXPECT_EQ(a->T_rig_world.rotation().coeffs(), b->T_rig_world.rotation().coeffs());
  EXPECT_EQ(a->matches, b->matches);
}

// The same geometry with other descriptors.
TEST_P(VerifyPlaceRig, RejectsAHallThatLooksDifferent) {
  const HallMap& world = map_without_drift(GetParam());
  const FeatureSimulator simulator = hall(rig_of(GetParam()));
  for (int at = 0; at < 30; ++at) {
    const SimulatedFrame other =
        redecorated(simulator.frame(FrameId(1000 + at), kStepS * at), 1.0, static_cast<std::uint64_t>(at));
    VerificationReport report;
    EXPECT_FALSE(verify_place(world.map, world.map.rig(), other.frame, KeyframeId(at), {}, kFeatures,
                              seeded(static_cast<std::uint64_t>(at)), &report));
    EXPECT_TRUE(report.rejection == Rejection::kFewMatches || report.rejection == Rejection::kNoConsensus);
  }
}

// One landmark in eight is the same in both halls: the geometry agrees, but too few of the expected landmarks are
// found.
TEST_P(VerifyPlaceRig, RejectsAHallThatLooksPartlyAlike) {
  const HallMap& world = map_without_drift(GetParam());
  const FeatureSimulator simulator = hall(rig_of(GetParam()));
  std::set<Rejection> reasons;
  for (int at = 0; at < 30; ++at) {
    const SimulatedFrame other =
        redecorated(simulator.frame(FrameId(1000 + at), kStepS * at), 0.875, static_cast<std::uint64_t>(at));
    VerificationReport report;
    EXPECT_FALSE(verify_place(world.map, world.map.rig(), other.frame, KeyframeId(at), {}, kFeatures,
                              seeded(static_cast<std::uint64_t>(at)), &report));
    reasons.insert(report.rejection);
  }
  // If fewer inliers are required, the fraction of found landmarks is decisive.
  VerificationOptions options;
  options.min_inliers = 15;
  const SimulatedFrame other = redecorated(simulator.frame(FrameId(2000), kStepS * 8), 0.875, 1);
  VerificationReport report;
  EXPECT_FALSE(
      verify_place(world.map, world.map.rig(), other.frame, KeyframeId(8), options, kFeatures, seeded(1), &report));
  EXPECT_EQ(report.rejection, Rejection::kFewFound);
  EXPECT_LT(report.found, report.expected / 4);
  EXPECT_FALSE(reasons.contains(Rejection::kNone));
}

// A place that was seen for long has more landmarks than a frame has features.
TEST(VerifyPlace, ADenseMapNeedNotBeFoundInAFrameWithFewFeatures) {
  const HallMap& world = map_without_drift(4);
  for (const double detected : {0.85, 0.12}) {
    synthetic::FeatureSimulatorOptions few = hall_options();
    few.detection_share = detected;
    const SimulatedFrame seen = FeatureSimulator(rig_of(4), laps(0.0), few).frame(FrameId(1000), kStepS * 11);
    VerificationReport report;
    const auto place_match =
        verify_place(world.map, world.map.rig(), seen.frame, KeyframeId(11), {}, kFeatures, seeded(1), &report);
    ASSERT_TRUE(place_match) << report.found << " of " << report.expected << " with " << seen.frame.bundled.size();
    expect_true_pose(*place_match, seen.T_world_rig.inverse());
    EXPECT_EQ(report.found < 0.2 * report.expected, detected < 0.5) << report.found << " of " << report.expected;
  }
}

TEST_P(VerifyPlaceRig, RejectsAnotherPlaceOfTheHall) {
  const HallMap& world = map_without_drift(GetParam());
  const FeatureSimulator simulator = hall(rig_of(GetParam()));
  for (int at = 0; at < 12; ++at) {
    const SimulatedFrame seen = simulator.frame(FrameId(1000 + at), kStepS * at);
    VerificationReport report;
    EXPECT_FALSE(verify_place(world.map, world.map.rig(), seen.frame, KeyframeId(at + 20), {}, kFeatures,
                              seeded(static_cast<std::uint64_t>(at)), &report));
    EXPECT_EQ(report.rejection, Rejection::kFewMatches);
  }
}

INSTANTIATE_TEST_SUITE_P(Cameras, VerifyPlaceRig, ::testing::Values(1, 2, 4));

// Landmarks seen from a direction that differs by more than `max_angle` from the viewing direction in the map look
// different.
SimulatedFrame changed_in_new_directions(SimulatedFrame seen, const HallMap& world, double max_angle) {
  std::map<int, Eigen::Vector3d> known_direction;
  for (const LandmarkId l : world.map.landmark_ids())
    known_direction[world.shown_by_landmark[l.index()].second] = world.map.landmark(l).view_direction;
  const Eigen::Vector3d centre = seen.T_world_rig.translation();
  for (std::size_t c = 0; c < seen.landmark.size(); ++c) {
    std::vector<feature::Descriptor> descriptors = seen.frame.cameras[c].keypoints.descriptor.copy();
    for (std::size_t k = 0; k < seen.landmark[c].size(); ++k) {
      const auto at = known_direction.find(seen.landmark[c][k]);
      if (at == known_direction.end()) continue;
      const Eigen::Vector3d direction =
          (hall_landmarks()[static_cast<std::size_t>(at->first)].position - centre).normalized();
      if (direction.dot(at->second) > std::cos(max_angle)) continue;
      Random random(1, "aside", static_cast<std::uint64_t>(at->first));
      for (std::uint64_t& word : descriptors[k]) word ^= random.next();
    }
    seen.frame.cameras[c].keypoints.descriptor = std::move(descriptors);
  }
  return seen;
}

TEST(VerifyPlace, IgnoresLandmarksExpectedOnlyFromNewDirections) {
  const HallMap& world = map_without_drift(4);
  const SimulatedFrame seen = hall(rig_of(4)).frame(FrameId(1000), kStepS * 11 + 0.5);
  VerificationOptions options;
  const SimulatedFrame changed =
      redecorated(changed_in_new_directions(seen, world, options.max_viewing_angle), 0.69, 1);
  VerificationReport report;
  const auto place_match =
      verify_place(world.map, world.map.rig(), changed.frame, KeyframeId(11), options, kFeatures, seeded(1), &report);
  ASSERT_TRUE(place_match) << report.found << " of " << report.expected;
  expect_true_pose(*place_match, seen.T_world_rig.inverse());
  options.max_viewing_angle = 1.05;
  EXPECT_FALSE(
      verify_place(world.map, world.map.rig(), changed.frame, KeyframeId(11), options, kFeatures, seeded(1), &report));
  EXPECT_EQ(report.rejection, Rejection::kFewFound);
}

// If hardly any landmark is seen from about the same direction, all landmarks in view are compared.
TEST(VerifyPlace, ComparesAllLandmarksIfAllViewingDirectionsAreNew) {
  const HallMap& world = map_without_drift(4);
  const SimulatedFrame seen = redecorated(hall(rig_of(4)).frame(FrameId(1000), kStepS * 11 + 0.5), 0.85, 1);
  VerificationOptions options;
  options.max_viewing_angle = 1e-4;
  VerificationReport report;
  EXPECT_FALSE(
      verify_place(world.map, world.map.rig(), seen.frame, KeyframeId(11), options, kFeatures, seeded(1), &report));
  EXPECT_EQ(report.rejection, Rejection::kFewFound);
  EXPECT_GT(report.expected, 100);
}

// The rig moves in the opposite direction: landmarks of the left camera are now in view of the right one.
TEST(VerifyPlace, MatchesLandmarksOfOtherCameras) {
  const HallMap& world = map_without_drift(4);
  const FeatureSimulator back = hall(rig_of(4), std::numbers::pi);
  for (const int at : {5, 14, 22}) {
    const SimulatedFrame seen = back.frame(FrameId(1000 + at), kStepS * at + 0.3);
    VerificationReport report;
    const auto place_match =
        verify_place(world.map, world.map.rig(), seen.frame, KeyframeId(at), {}, kFeatures, seeded(1), &report);
    ASSERT_TRUE(place_match) << "rejected for " << static_cast<int>(report.rejection);
    expect_true_pose(*place_match, seen.T_world_rig.inverse());
    int by_other_camera = 0;  // matches with landmarks that this camera has not observed
    for (const auto& [feature, l] : place_match->matches) {
      std::set<CameraIndex> observers;
      for (const map::Observation& o : world.map.observations(l)) {
        for (const frame::KeypointRef r : world.map.keyframe(o.keyframe).frame->bundled.keypoints(o.feature))
          observers.insert(r.camera);
      }
      by_other_camera += !observers.contains(seen.frame.bundled.keypoints(feature).front().camera);
    }
    EXPECT_GT(by_other_camera, 50);
  }
}

TEST(VerifyPlace, FisheyesFindThePoseInTheOppositeViewingDirection) {
  const camera::Rig rig = synthetic::fisheye_rig(2);
  HallMap world(rig);
  const FeatureSimulator simulator = hall(rig), back = hall(rig, std::numbers::pi);
  for (int i = 0; i < 6; ++i) world.add(simulator.frame(FrameId(i), kStepS * i));
  const SimulatedFrame seen = back.frame(FrameId(1000), kStepS * 2 + 0.5);
  const auto place_match =
      verify_place(world.map, world.map.rig(), seen.frame, KeyframeId(2), {}, kFeatures, seeded(1));
  ASSERT_TRUE(place_match);
  expect_true_pose(*place_match, seen.T_world_rig.inverse(), 0.015);  // 3 times fewer pixels per radian
}

TEST(VerifyPlace, LandmarksAroundAKeyframeAreOrderedByObservations) {
  const HallMap& world = map_without_drift(1);
  const std::vector<LandmarkId> all = landmarks_around(world.map, KeyframeId(9), 4, 100000),
                                few = landmarks_around(world.map, KeyframeId(9), 4, 50);
  const std::set<LandmarkId> distinct(all.begin(), all.end());
  EXPECT_EQ(distinct.size(), all.size());
  for (const LandmarkId l : world.map.keyframe(KeyframeId(9)).landmarks)
    EXPECT_TRUE(!l.valid() || distinct.contains(l));
  for (const map::Covisible& c : world.map.best_covisible(KeyframeId(9), 4)) {
    for (const LandmarkId l : world.map.keyframe(c.keyframe).landmarks) EXPECT_TRUE(!l.valid() || distinct.contains(l));
  }
  ASSERT_EQ(few.size(), 50u);
  EXPECT_TRUE(std::equal(few.begin(), few.end(), all.begin()));
  for (std::size_t i = 1; i < all.size(); ++i)
    EXPECT_GE(world.map.observations(all[i - 1]).size(), world.map.observations(all[i]).size());
}

}  // namespace
}  // namespace bslam::looping
