#include "frame/capture_times.h"

#include <gtest/gtest.h>

#include <numbers>

namespace bslam::frame {
namespace {

using Flags = std::vector<std::uint8_t>;

image::ImageBundle taken_at(const std::vector<TimeNs>& times) {
  image::ImageBundle bundle;
  bundle.time_ns = times[0];
  for (const TimeNs t : times) bundle.images.push_back({image::ImageState::kPresent, t, {}});
  return bundle;
}

constexpr TimeNs kMs = 1'000'000;

// One camera for each yaw in degrees, 0.1 m apart.
camera::Rig looking(const std::vector<double>& yaws) {
  std::vector<camera::RigCamera> cameras;
  for (const double yaw : yaws) {
    const geometry::Quaterniond R(Eigen::AngleAxisd(yaw * std::numbers::pi / 180, Eigen::Vector3d::UnitY()));
    const Eigen::Vector3d t(0.1 * static_cast<double>(cameras.size()), 0, 0);
    cameras.push_back(
        {camera::Camera{"cam", camera::Pinhole({450, 450, 375, 239}), 752, 480, 0, ""}, geometry::SE3(R, t)});
  }
  return camera::Rig(std::move(cameras));
}

TEST(CaptureTimes, SkipsCamerasThatCapturedLater) {
  const camera::Rig rig = looking({0, 0, 90, -90});
  EXPECT_EQ(without_late_cameras(rig, taken_at({0, 0, 15 * kMs, 15 * kMs}), Flags(4, 0)), Flags({0, 0, 1, 1}));
  EXPECT_EQ(without_late_cameras(rig, taken_at({0, kMs, -kMs, 0}), Flags(4, 0)), Flags(4, 0))
      << "one millisecond counts as simultaneous";
}

TEST(CaptureTimes, KeepsSkippedCameras) {
  const camera::Rig rig = looking({0, 0, 90, -90});
  EXPECT_EQ(without_late_cameras(rig, taken_at({0, 0, 0, 15 * kMs}), Flags({0, 0, 1, 0})), Flags({0, 0, 1, 1}));
}

TEST(CaptureTimes, SkipsNoCameraIfNoneWouldRemain) {
  const camera::Rig rig = looking({0, 0, 90, -90});
  EXPECT_EQ(without_late_cameras(rig, taken_at({0, 0, 15 * kMs, 15 * kMs}), Flags({1, 1, 0, 0})), Flags({1, 1, 0, 0}));
}

TEST(CaptureTimes, KeepsTheOnlyOverlappingViews) {
  const camera::Rig rig = looking({0, 0});
  ASSERT_TRUE(rig.any_overlap());
  EXPECT_EQ(without_late_cameras(rig, taken_at({0, 15 * kMs}), Flags(2, 0)), Flags(2, 0));
}

TEST(CaptureTimes, SpanIsFromTheFirstToTheLastImage) {
  BundledFrame frame;
  frame.time_ns = 100 * kMs;
  frame.cameras.resize(3);
  const TimeNs times[] = {100 * kMs, 90 * kMs, 105 * kMs};
  for (std::size_t c = 0; c < 3; ++c) {
    frame.cameras[c].state = image::ImageState::kPresent;
    frame.cameras[c].time_ns = times[c];
  }
  EXPECT_NEAR(capture_span_s(frame), 0.015, 1e-12);
}

}  // namespace
}  // namespace bslam::frame
