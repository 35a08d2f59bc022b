#include "tracking/stamp_errors.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

constexpr int kFrames = 40;
constexpr double kFirst_s = 0.05;

struct Tracked {
  TrackerState state;
  double pose_error_m = 0, time_error_s = 0;  // mean, and root mean square, of the second half of the frames
};

// Tracks frames in a true map. The stamps of all cameras but the first have normal errors and a constant one. Without
// `corrects`, what the frames show of the errors is forgotten.
Tracked track_with_wrong_stamps(double deviation_s, double constant_s, bool corrects) {
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 2.5, 0.25);
  const auto sim = simulator(synthetic::default_rig());
  SimulatedTracker tracker(world);
  Random random(2, "stamps");
  Tracked out;
  int images = 0;
  for (int i = 1; i <= kFrames; ++i) {
    auto seen = sim.frame(FrameId(i), kFirst_s * i);
    std::vector<double> errors(seen.frame.cameras.size(), 0.0);
    for (std::size_t c = 1; c < errors.size(); ++c) {
      errors[c] = constant_s + deviation_s * random.normal();
      seen.frame.cameras[c].time_ns += from_seconds(errors[c]);
    }
    const TrackOutput tracked = tracker.track(seen.frame);
    EXPECT_EQ(tracked.result.status, TrackStatus::kTracking) << i;
    if (!corrects) tracker.state.stamps.clear();
    if (2 * i <= kFrames) continue;
    out.pose_error_m += map::distance_m(tracked.result.T_rig_world, seen.T_world_rig.inverse()) / (kFrames / 2);
    for (std::size_t c = 1; c < errors.size(); ++c, ++images)
      out.time_error_s += std::pow(errors[c] + to_seconds(tracked.frame.cameras[c].correction_ns), 2);
  }
  out.state = tracker.state;
  out.time_error_s = std::sqrt(out.time_error_s / images);
  return out;
}

TEST(StampErrors, AreFoundAndCorrected) {
  constexpr double kDeviation_s = 0.004;
  const Tracked corrected = track_with_wrong_stamps(kDeviation_s, 0, true);
  const Tracked uncorrected = track_with_wrong_stamps(kDeviation_s, 0, false);
  std::printf("errors of poses and capture times: %.2f mm, %.2f ms, uncorrected %.2f mm, %.2f ms\n",
              1e3 * corrected.pose_error_m, 1e3 * corrected.time_error_s, 1e3 * uncorrected.pose_error_m,
              1e3 * uncorrected.time_error_s);
  EXPECT_LT(corrected.pose_error_m, 0.7 * uncorrected.pose_error_m);
  EXPECT_LT(corrected.time_error_s, 0.3 * uncorrected.time_error_s);
  EXPECT_EQ(corrected.state.stamps[0].variance_s2, 0);
  for (std::size_t c = 1; c < corrected.state.stamps.size(); ++c)
    EXPECT_NEAR(std::sqrt(corrected.state.stamps[c].variance_s2), kDeviation_s, 0.5 * kDeviation_s) << "camera " << c;
}

TEST(StampErrors, ExactStampsStayAsTheyAre) {
  const Tracked exact = track_with_wrong_stamps(0, 0, true);
  EXPECT_EQ(exact.time_error_s, 0);
  EXPECT_LT(exact.pose_error_m, 0.006);
}

// A time offset belongs to the calibration, which estimates it.
TEST(StampErrors, AConstantErrorIsNotCorrected) {
  EXPECT_NEAR(track_with_wrong_stamps(0, 0.004, true).time_error_s, 0.004, 1e-9);
}

// The part of the errors that differs from image to image is corrected, whatever the constant one is. A blind camera
// shows nothing of the error of its stamp, which is then expected to be the constant one.
TEST(StampErrors, AConstantErrorRemainsWhereTheOthersAreCorrected) {
  constexpr double kDeviation_s = 0.003, kConstant_s = 0.006;
  const auto sim = simulator(synthetic::default_rig());
  const map::SimulatedMap world = true_map(sim, 2.5, 0.25);
  SimulatedTracker tracker(world);
  Random random(4, "stamps");
  std::vector<double> remaining_s;
  double given_s = 0;
  for (int i = 1; i <= kFrames; ++i) {
    auto seen = sim.frame(FrameId(i), kFirst_s * i);
    const double error_s = kConstant_s + kDeviation_s * random.normal();
    seen.frame.cameras[1].time_ns += from_seconds(error_s);
    given_s += error_s;
    const bool blind = i == kFrames;
    if (blind) seen.frame.cameras[1].keypoints = {};
    const TrackOutput tracked = tracker.track(seen.frame);
    const double corrected_s = to_seconds(tracked.frame.cameras[1].correction_ns);
    if (blind) {
      EXPECT_NEAR(corrected_s, 0, 1e-5);
    } else if (2 * i > kFrames) {
      remaining_s.push_back(error_s + corrected_s);
    }
  }
  const Eigen::Map<const Eigen::ArrayXd> errors(remaining_s.data(), std::ssize(remaining_s));
  EXPECT_NEAR(errors.mean(), given_s / kFrames, 0.0015);
  EXPECT_LT(std::sqrt((errors - errors.mean()).square().mean()), 0.4 * kDeviation_s);
}

// The errors are relative to the camera that determines the time of the frame: every other frame camera 1, whose stamps
// have a constant error.
TEST(StampErrors, AnotherReferenceCameraIsNoEvidence) {
  constexpr std::array kFirst = {0};
  const auto sim = simulator(synthetic::default_rig());
  const map::SimulatedMap world = true_map(sim, 2.5, 0.25);
  SimulatedTracker tracker(world);
  for (int i = 1; i <= kFrames; ++i) {
    const bool without_first = i % 2 == 1;
    auto seen =
        sim.frame(FrameId(i), kFirst_s * i, without_first ? std::span<const int>(kFirst) : std::span<const int>());
    if (without_first) {
      for (std::size_t c = 2; c < seen.frame.cameras.size(); ++c) seen.frame.cameras[c].time_ns += 4'000'000;
    } else {
      seen.frame.cameras[1].time_ns -= 4'000'000;
    }
    const TrackOutput tracked = tracker.track(seen.frame);
    for (const frame::CameraFrame& camera : tracked.frame.cameras) EXPECT_EQ(camera.correction_ns, 0) << i;
  }
}

TEST(StampErrors, AnEstimateOfTheTimeOffsetTakesTheConstantErrorAway) {
  constexpr double kDeviation_s = 0.003, kConstant_s = 0.006;
  const auto sim = simulator(synthetic::default_rig());
  map::SimulatedMap world = true_map(sim, 2.5, 0.25);
  SimulatedTracker tracker(world);
  Random random(4, "stamps");
  double sum_s = 0;
  for (int i = 1; i <= kFrames; ++i) {
    auto seen = sim.frame(FrameId(i), kFirst_s * i);
    const bool estimated = 2 * i > kFrames;
    const double error_s = (estimated ? 0 : kConstant_s) + kDeviation_s * random.normal();
    seen.frame.cameras[1].time_ns += from_seconds(error_s);
    if (2 * i == kFrames + 2) {
      std::vector<camera::RigCamera> cameras;
      for (std::size_t c = 0; c < sim.rig().size(); ++c)
        cameras.push_back({sim.rig().camera(c), sim.rig().body_from_cam(c)});
      cameras[1].camera.time_offset_ns -= from_seconds(kConstant_s);
      world.map.set_rig(std::make_shared<const camera::Rig>(std::move(cameras)));
    }
    const TrackOutput tracked = tracker.track(seen.frame);
    if (estimated) sum_s += error_s + to_seconds(tracked.frame.cameras[1].correction_ns);
  }
  EXPECT_NEAR(sum_s / (kFrames / 2), 0, 0.0015);
}

TEST(StampErrors, ASingleWrongStampIsNoEvidence) {
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 1.0, 0.25);
  const auto sim = simulator(synthetic::default_rig());
  SimulatedTracker tracker(world);
  for (int i = 1; i <= 15; ++i) {
    auto seen = sim.frame(FrameId(i), kFirst_s * i);
    if (i == 8) seen.frame.cameras[1].time_ns += 5'000'000;
    const TrackOutput tracked = tracker.track(seen.frame);
    for (const frame::CameraFrame& camera : tracked.frame.cameras) EXPECT_EQ(camera.correction_ns, 0) << i;
  }
}

}  // namespace
}  // namespace bslam::tracking
