#include "tracking/camera_consensus.h"

#include <gtest/gtest.h>

#include "map/keyframe_landmarks.h"
#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

using Flags = std::vector<std::uint8_t>;

TEST(CameraConsensus, FlagsCamerasThatLoseTheirLandmarksWhileAnotherDoesNot) {
  const ConsensusOptions options;
  EXPECT_EQ(cameras_losing_view({{100, 80}, {100, 2}}, {}, std::vector<CameraConsensusState>(3), options),
            Flags({0, 1}));
  EXPECT_EQ(cameras_losing_view({{100, 3}, {100, 2}, {60, 50}}, {}, std::vector<CameraConsensusState>(3), options),
            Flags({1, 1, 0}));
  // Direct tracking has just found most of the landmarks of the camera, or few.
  EXPECT_EQ(cameras_losing_view({{100, 80}, {100, 2}}, std::vector<LandmarkCounts>{{90, 80}, {60, 50}},
                                std::vector<CameraConsensusState>(3), options),
            Flags({0, 0}));
  EXPECT_EQ(cameras_losing_view({{100, 80}, {100, 2}}, std::vector<LandmarkCounts>{{90, 80}, {60, 10}},
                                std::vector<CameraConsensusState>(3), options),
            Flags({0, 1}));
  EXPECT_EQ(cameras_losing_view({{100, 80}, {100, 30}}, {}, std::vector<CameraConsensusState>(3), options),
            Flags({0, 0}))
      << "re-observed fraction above the minimum";
  EXPECT_EQ(cameras_losing_view({{100, 80}, {10, 0}}, {}, std::vector<CameraConsensusState>(3), options), Flags({0, 0}))
      << "too few expected landmarks";
  EXPECT_EQ(cameras_losing_view({{100, 5}, {100, 2}}, {}, std::vector<CameraConsensusState>(3), options), Flags({0, 0}))
      << "no healthy camera";
}

TEST(CameraConsensus, ReadmitsAfterConsecutiveConsistentFrames) {
  const ConsensusOptions options;
  CameraConsensusState camera;
  update_exclusion(camera, {100, 0}, 1.0, 0, options);
  for (int i = 1; i < options.readmit_after; ++i) {
    update_exclusion(camera, {100, 50}, 1.0, 0, options);
    EXPECT_TRUE(camera.excluded);
  }
  update_exclusion(camera, {100, 1}, 1.0, 0, options);  // restarts the count
  for (int i = 0; i < options.readmit_after; ++i) {
    EXPECT_TRUE(camera.excluded);
    update_exclusion(camera, {100, 50}, 1.0, 0, options);
  }
  EXPECT_FALSE(camera.excluded);
}

// Of a large map even a camera in use finds few landmarks.
TEST(CameraConsensus, ReadmitsACameraThatFindsAsManyLandmarksAsAnotherOne) {
  const ConsensusOptions options;
  for (const int found : {1, 10}) {
    CameraConsensusState camera;
    for (int k = 0; k < options.readmit_after; ++k) update_exclusion(camera, {100, found}, 0.2, k, options);
    EXPECT_EQ(camera.excluded, found == 1) << found;
  }
}

TEST(CameraConsensus, AViewWhoseLandmarksAreInTheirPlaceIsNotDisplaced) {
  const ConsensusOptions options;
  CameraConsensusState camera;
  update_exclusion(camera, {100, 2}, 1.0, 0, options);
  retry(camera, {100, 14}, {100, 16}, from_seconds(options.retry_after_s), options);
  EXPECT_FALSE(camera.excluded);
}

TEST(CameraConsensus, ReadmitsACameraThatCannotBeChecked) {
  const ConsensusOptions options;
  CameraConsensusState camera;
  update_exclusion(camera, {3, 0}, 1.0, 0, options);
  update_exclusion(camera, {3, 0}, 1.0, from_seconds(options.forget_after_s - 0.1), options);
  EXPECT_TRUE(camera.excluded);
  update_exclusion(camera, {3, 0}, 1.0, from_seconds(options.forget_after_s), options);
  EXPECT_FALSE(camera.excluded);
}

TEST(CameraConsensus, KeepsACameraThatLosesItsLandmarksGradually) {
  const ConsensusOptions options;
  const std::vector<LandmarkCounts> now = {{100, 80}, {100, 2}, {100, 2}};
  std::vector<CameraConsensusState> before(3);
  update_reobservation_ratio(before[1], {100, 70}, options);
  update_reobservation_ratio(before[2], {100, 45}, options);
  EXPECT_EQ(cameras_losing_view(now, {}, before, options), (std::vector<std::uint8_t>{0, 1, 0}));
  update_reobservation_ratio(before[1], {10, 0}, options);  // too few landmarks, no update
  EXPECT_EQ(cameras_losing_view(now, {}, before, options), (std::vector<std::uint8_t>{0, 1, 0}));
}

TEST(CameraConsensus, RetriesACameraAfterALongTimeUnlessItsViewIsDisplaced) {
  const ConsensusOptions options;
  const TimeNs later = from_seconds(options.retry_after_s);
  for (const bool displaced : {false, true}) {
    CameraConsensusState camera;
    update_exclusion(camera, {100, 2}, 1.0, 0, options);
    EXPECT_FALSE(due_for_retry(camera, later - 1, options));
    update_exclusion(camera, {100, 2}, 1.0, later, options);
    ASSERT_TRUE(due_for_retry(camera, later, options));
    retry(camera, {100, 2}, {100, displaced ? 60 : 3}, later, options);
    EXPECT_EQ(camera.excluded, displaced);
    EXPECT_FALSE(due_for_retry(camera, later + 1, options));
    EXPECT_EQ(due_for_retry(camera, 2 * later, options), displaced);
  }
}

TEST(CameraConsensus, ReadmitsOnlyCamerasThatObserveThePlaceAfterALoss) {
  std::vector<CameraConsensusState> cameras(3);
  cameras[0].excluded = cameras[1].excluded = true;
  cameras[2].landmarks = {LandmarkId(4)};
  const auto after = readmit_observing_cameras(cameras, {5, 60, 0}, {});
  EXPECT_TRUE(after[0].excluded);
  EXPECT_FALSE(after[1].excluded);
  EXPECT_TRUE(after[2].landmarks.empty());
  EXPECT_FALSE(after[0].established || after[2].established);
  EXPECT_TRUE(after[1].established);
}

// In a blurred frame few matches of any camera agree with the pose. Only a camera with clearly fewer than the best one
// contradicts it.
TEST(CameraConsensus, FewInliersInAllCamerasAreNoContradiction) {
  std::vector<CameraConsensusState> cameras(2);
  for (CameraConsensusState& camera : cameras) camera.established = true;
  EXPECT_EQ(conflicting_cameras({{100, 34}, {200, 56}}, cameras, {}), (std::vector<std::uint8_t>{0, 1}));
  EXPECT_EQ(contradicting_cameras({{100, 34}, {200, 56}}, cameras, {}), (std::vector<std::uint8_t>{0, 0}));
  EXPECT_EQ(contradicting_cameras({{100, 34}, {200, 30}}, cameras, {}), (std::vector<std::uint8_t>{0, 1}));
  EXPECT_EQ(contradicting_cameras({{100, 90}, {200, 56}}, cameras, {}), (std::vector<std::uint8_t>{0, 1}));
  EXPECT_EQ(contradicting_cameras({{100, 90}, {200, 120}}, cameras, {}), (std::vector<std::uint8_t>{0, 0}));
}

// Camera 1 has few matches, most of them on something that moves. If camera 0 sees it move as well, and agrees with the
// pose nevertheless, this is no evidence against camera 1.
TEST(CameraConsensus, WhatMovesInTheImagesOfTwoCamerasIsNoConflict) {
  std::vector<CameraConsensusState> cameras(2);
  for (CameraConsensusState& camera : cameras) camera.established = true;
  for (const bool same_landmarks : {true, false}) {
    FrameMatches matches(2);
    std::vector<std::uint8_t> inlier;
    for (std::size_t i = 0; i < 100; ++i) {  // the last 40 move
      matches[0].push_back({KeypointIndex(i), LandmarkId(i)});
      inlier.push_back(i < 60);
    }
    for (std::size_t i = 0; i < 40; ++i) {  // 8 do not move
      matches[1].push_back({KeypointIndex(i), LandmarkId(i < 8 ? i : 60 + i + (same_landmarks ? 0 : 100))});
      inlier.push_back(i < 8);
    }
    const std::vector<LandmarkCounts> agreeing = count_agreeing(matches, inlier, {});
    EXPECT_EQ(agreeing[0].expected, 100);
    EXPECT_EQ(agreeing[0].found, 60);
    EXPECT_EQ(agreeing[1].expected, same_landmarks ? 8 : 40);
    EXPECT_EQ(agreeing[1].found, 8);
    EXPECT_EQ(conflicting_cameras(agreeing, cameras, {})[1], !same_landmarks);
  }
}

// A camera that captures late is skipped until the motion is known. Its first matches are to landmarks observed by
// other cameras only, and may be wrong.
TEST(CameraConsensus, DoesNotFlagACameraThatIsNotEstablished) {
  std::vector<CameraConsensusState> cameras(2);
  cameras[0].established = true;
  EXPECT_EQ(conflicting_cameras({{100, 95}, {33, 7}}, cameras, {}), (std::vector<std::uint8_t>{0, 0}));
  EXPECT_EQ(conflicting_cameras({{100, 20}, {33, 7}}, cameras, {}), (std::vector<std::uint8_t>{1, 0}));
  cameras[1].established = true;
  EXPECT_EQ(conflicting_cameras({{100, 95}, {33, 7}}, cameras, {}), (std::vector<std::uint8_t>{0, 1}));
  update_exclusion(cameras[1], {100, 2}, 1.0, 0, {});
  for (int k = 1; k <= ConsensusOptions{}.readmit_after; ++k) update_exclusion(cameras[1], {100, 60}, 1.0, k, {});
  EXPECT_FALSE(cameras[1].excluded);
  EXPECT_TRUE(cameras[1].established);
}

class WrongImages : public ::testing::Test {
 protected:
  static const map::SimulatedMap& world() {
    static const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 2.0, 0.25);
    return world;
  }
  // Frame i with the image of camera `from` in camera `to`: bearings are computed with the model of `to`.
  static synthetic::SimulatedFrame with_images_of(int i, std::size_t to, std::size_t from) {
    synthetic::SimulatedFrame seen = world().sim.frame(FrameId(i), 0.05 * i);
    frame::CameraFrame& camera = seen.frame.cameras[to];
    const camera::Rig& rig = world().map.rig();
    camera.keypoints = seen.frame.cameras[from].keypoints;
    feature::Refinement positions = camera.keypoints.positions();
    for (std::size_t k = 0; k < camera.keypoints.size(); ++k) {
      const auto bearing = rig.camera(to).unproject(positions.pixel[k].cast<double>());
      if (bearing) positions.bearing[k] = *bearing;
    }
    camera = frame::refined(camera, std::move(positions), rig.camera(to));
    seen.frame.bundled = matching::make_bundled(rig, seen.frame.cameras, {}, 5e-4, 7.81);
    return seen;
  }
};

TEST_F(WrongImages, AreExcludedImmediatelyAndTheCameraIsReadmittedLater) {
  SimulatedTracker tracker(world());
  const int readmitted = 20 + ConsensusOptions{}.readmit_after;
  for (int i = 1; i < 30; ++i) {
    const bool wrong = i >= 10 && i < 20;
    const auto seen = wrong ? with_images_of(i, 2, 3) : world().sim.frame(FrameId(i), 0.05 * i);
    const TrackOutput out = tracker.track(seen.frame);
    ASSERT_EQ(out.result.status, TrackStatus::kTracking) << i;
    EXPECT_LT(map::distance_m(out.result.T_rig_world, seen.T_world_rig.inverse()), 0.012) << i;
    EXPECT_EQ(out.result.cameras[2].excluded, i >= 10 && i < readmitted) << i;
    EXPECT_EQ(out.result.cameras[2].inliers > 0, !out.result.cameras[2].excluded) << i;
    for (const std::size_t c : {0, 1, 3})
      EXPECT_FALSE(out.result.cameras[c].excluded) << "camera " << c << ", frame " << i;
  }
}

TEST_F(WrongImages, AreExcludedForACameraOfHalfTheRate) {
  SimulatedTracker tracker(world());
  const int readmitted = 20 + 2 * ConsensusOptions{}.readmit_after;
  const std::vector<int> missing = {2};
  for (int i = 1; i < 36; ++i) {
    const bool wrong = i >= 10 && i < 20;
    const auto seen = i % 2 == 1 ? world().sim.frame(FrameId(i), 0.05 * i, missing)
                      : wrong    ? with_images_of(i, 2, 3)
                                 : world().sim.frame(FrameId(i), 0.05 * i);
    const TrackOutput out = tracker.track(seen.frame);
    ASSERT_EQ(out.result.status, TrackStatus::kTracking) << i;
    if (i % 2 == 1) continue;
    EXPECT_EQ(out.result.cameras[2].excluded, i >= 10 && i < readmitted) << i;
  }
}

// Most landmarks in the view of the fisheye are known from the front cameras only, and look different in its image.
TEST(ExcludedCamera, IsComparedWithTheLandmarksThatItHasObserved) {
  constexpr std::size_t kFisheye = 2;
  auto few = room();
  few.max_keypoints = 60;
  map::SimulatedMap world(simulator(synthetic::mixed_rig(), few));
  world.add_keyframe(FrameId(1000), 0.0);
  const auto own = map::observed_by(world.map, world.map.landmark_ids(), CameraIndex(kFisheye));
  ASSERT_GE(static_cast<int>(own.size()), ConsensusOptions{}.min_expected);
  world.sim = simulator(synthetic::mixed_rig());
  world.change_frame = [&](frame::BundledFrame& frame) { remove_camera(world.sim.rig(), kFisheye, 5e-4, 7.81, frame); };
  for (int i = 1; i < 10; ++i) world.add_keyframe(FrameId(1000 + i), 0.1 * i);
  EXPECT_EQ(map::observed_by(world.map, world.map.landmark_ids(), CameraIndex(kFisheye)), own);

  SimulatedTracker tracker(world);
  for (int i = 1; i < 12; ++i) {
    synthetic::SimulatedFrame seen = world.sim.frame(FrameId(i), 0.05 * i);
    auto& keypoints = seen.frame.cameras[kFisheye].keypoints;
    std::vector<feature::Descriptor> descriptors = keypoints.descriptor.copy();
    for (std::size_t k = 0; k < keypoints.size(); ++k) {
      const auto known = world.landmark_of.find(seen.landmark[kFisheye][k]);
      const bool is_own = known != world.landmark_of.end() && std::ranges::binary_search(own, known->second);
      if (!is_own) descriptors[k].fill(0);
    }
    keypoints.descriptor = std::move(descriptors);
    const TrackOutput out = tracker.track(seen.frame);
    ASSERT_EQ(out.result.status, TrackStatus::kTracking) << i;
    EXPECT_EQ(out.result.cameras[kFisheye].excluded, i > 3 && i <= 3 + ConsensusOptions{}.readmit_after) << i;
    if (i == 3) update_exclusion(tracker.state.cameras[kFisheye], {100, 0}, 1.0, seen.frame.time_ns, {});
  }
}

TEST_F(WrongImages, TrackingContinuesWithOneCorrectCamera) {
  SimulatedTracker tracker(world());
  for (int i = 1; i < 20; ++i) {
    auto seen = world().sim.frame(FrameId(i), 0.05 * i);
    if (i >= 8) {
      for (const std::size_t c : {0, 1, 2}) seen.frame.cameras[c] = with_images_of(i, c, (c + 2) % 4).frame.cameras[c];
      seen.frame.bundled = matching::make_bundled(world().map.rig(), seen.frame.cameras, {}, 5e-4, 7.81);
    }
    const TrackOutput out = tracker.track(seen.frame);
    ASSERT_EQ(out.result.status, TrackStatus::kTracking) << i;
    EXPECT_LT(map::distance_m(out.result.T_rig_world, seen.T_world_rig.inverse()), 0.03) << i;
    EXPECT_FALSE(out.result.cameras[3].excluded) << i;
    EXPECT_EQ(out.result.cameras[2].excluded, i >= 8) << i;
  }
}

TEST(RemoveCamera, KeepsTheFeaturesOfTheOtherCameras) {
  const auto sim = simulator(synthetic::ring_rig(3));
  frame::BundledFrame frame = sim.frame(FrameId(1), 0.5).frame;
  const std::size_t others = frame.cameras[0].keypoints.size() + frame.cameras[1].keypoints.size();
  remove_camera(sim.rig(), 2, 5e-4, 7.81, frame);
  EXPECT_EQ(frame.num_keypoints(), others);
  EXPECT_EQ(frame.cameras[2].state, image::ImageState::kMissing);
  std::size_t keypoints = 0;
  for (std::size_t f = 0; f < frame.bundled.size(); ++f) {
    for (const frame::KeypointRef r : frame.bundled.keypoints(FeatureId(f))) {
      EXPECT_NE(r.camera, CameraIndex(2));
      ++keypoints;
    }
  }
  EXPECT_EQ(keypoints, others);
}

}  // namespace
}  // namespace bslam::tracking
