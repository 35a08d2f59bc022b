#include "tracking/stamp_errors.h"

#include <gtest/gtest.h>

#include <cmath>

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
