#include "tracking/calibration_error.h"

#include <gtest/gtest.h>

#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

const matching::AlignmentOptions kOptions{.calibration_error_px = 0.3, .min_calibration_error_px = 0.05};
constexpr double kAlignment = 0.1;  // px

// Estimated calibration error after `frames` frames of `count` keypoints with a calibration error of `error` pixels and
// an alignment error of kAlignment.
double after(int frames, double error, int count, double before = kOptions.calibration_error_px) {
  Random random(1, "floor");
  const double sigma = std::hypot(error, kAlignment);
  for (int f = 0; f < frames; ++f) {
    std::vector<double> errors, variances(static_cast<std::size_t>(count), kAlignment * kAlignment);
    for (int i = 0; i < count; ++i) {
      const double x = sigma * random.normal(), y = sigma * random.normal();
      errors.push_back(x * x + y * y);
    }
    before = update_calibration_error(before, errors, variances, kOptions);
  }
  return before;
}

TEST(CalibrationError, ConvergesFromLargerAndSmallerValues) {
  EXPECT_NEAR(after(40, 0.15, 300), 0.15, 0.02);
  EXPECT_NEAR(after(40, 0.15, 300, 0.06), 0.15, 0.02);
}

TEST(CalibrationError, ExceedsItsInitialValueIfErrorsAreLarger) { EXPECT_NEAR(after(40, 1.2, 300), 1.2, 0.1); }

TEST(CalibrationError, FollowsAChangeWithinAboutTenFrames) {
  EXPECT_GT(after(3, 0.05, 300), 0.2);
  EXPECT_LT(after(20, 0.05, 300), 0.1);
}

TEST(CalibrationError, StaysWithinItsBounds) {
  EXPECT_NEAR(after(100, 0.0, 300), kOptions.min_calibration_error_px, 0.01);
  EXPECT_GE(after(100, 0.0, 300), kOptions.min_calibration_error_px);
  EXPECT_NEAR(after(100, 15.0, 300), kOptions.max_calibration_error_px, 1e-6);
}

TEST(CalibrationError, NeedsEnoughKeypoints) { EXPECT_EQ(after(10, 0.0, 10), kOptions.calibration_error_px); }

class CalibrationErrorsOfAFrame : public ::testing::Test {
 protected:
  CalibrationErrorsOfAFrame() : tracker(world) {
    frame = world.sim.frame(FrameId(1), 0.1).frame;
    for (frame::CameraFrame& c : frame.cameras) c.keypoints.sigma = std::vector<float>(c.keypoints.size(), 0.35f);
    output = tracker.track(frame);
  }
  static map::SimulatedMap make_world() {
    synthetic::FeatureSimulatorOptions options;
    options.sigma_px = 0.05;
    map::SimulatedMap out(synthetic::FeatureSimulator(synthetic::default_rig(), synthetic::make_orbit({}), options));
    out.add_keyframe(FrameId(0), 0.0);
    out.add_keyframe(FrameId(7), 1.0);
    return out;
  }
  map::SimulatedMap world = make_world();
  SimulatedTracker tracker;
  frame::BundledFrame frame;
  TrackOutput output;
};

TEST_F(CalibrationErrorsOfAFrame, DecreaseIfErrorsAreSmallerThanAssumed) {
  ASSERT_EQ(output.result.status, TrackStatus::kTracking);
  const auto errors = calibration_errors({}, world.map, frame, output, kOptions);
  ASSERT_EQ(errors.size(), 4u);
  for (std::size_t c = 0; c < 4; ++c) {
    EXPECT_LT(errors[c], kOptions.calibration_error_px) << "camera " << c;
    EXPECT_GT(errors[c], kOptions.min_calibration_error_px) << "camera " << c;
  }
}

TEST_F(CalibrationErrorsOfAFrame, AreEstimatedPerCamera) {
  Random random(1, "worse camera");
  std::vector<Eigen::Vector2f> pixels = frame.cameras[2].keypoints.pixel.copy();
  for (Eigen::Vector2f& pixel : pixels) pixel += 0.6f * Eigen::Vector2d(random.normal(), random.normal()).cast<float>();
  frame.cameras[2].keypoints.pixel = std::move(pixels);
  const auto errors = calibration_errors({}, world.map, frame, output, kOptions);
  for (const std::size_t c : {0u, 1u, 3u}) EXPECT_LT(errors[c] + 0.01, errors[2]) << "camera " << c;
}

TEST_F(CalibrationErrorsOfAFrame, AreKeptForCamerasWithoutMatches) {
  output.matches[2].clear();
  const std::vector<double> before = {0.2, 0.2, 0.17, 0.2};
  EXPECT_EQ(calibration_errors(before, world.map, frame, output, kOptions)[2], 0.17);
}

TEST_F(CalibrationErrorsOfAFrame, AreAtLeastTheInitialOnesAfterALostFrame) {
  output.result.status = TrackStatus::kLost;
  const std::vector<double> before = {0.1, 0.1, 0.8, 0.1};
  EXPECT_EQ(calibration_errors(before, world.map, frame, output, kOptions), (std::vector{0.3, 0.3, 0.8, 0.3}));
}

TEST(AlignmentByCamera, SetsTheCalibrationErrorOfEachCamera) {
  const auto some = alignment_by_camera(kOptions, std::vector<double>{0.1, 0.2}, 2);
  EXPECT_EQ(some[0].calibration_error_px, 0.1);
  EXPECT_EQ(some[1].calibration_error_px, 0.2);
  EXPECT_EQ(some[1].min_calibration_error_px, kOptions.min_calibration_error_px);
  EXPECT_EQ(alignment_by_camera(kOptions, {}, 3)[2].calibration_error_px, kOptions.calibration_error_px);
}

}  // namespace
}  // namespace bslam::tracking
