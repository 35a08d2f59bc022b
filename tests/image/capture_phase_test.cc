#include "image/capture_phase.h"

#include <gtest/gtest.h>

#include "base/random.h"

namespace bslam::image {
namespace {

constexpr TimeNs kMs = 1'000'000;

// Times of `count` images every `period_ms`, the first at `first_ms`, each off by up to `jitter_ms`.
std::vector<TimeNs> images(int count, int period_ms, int first_ms, int jitter_ms, std::uint64_t seed) {
  Random random(seed);
  std::vector<TimeNs> out;
  for (int k = 0; k < count; ++k)
    out.push_back((first_ms + k * period_ms) * kMs + static_cast<TimeNs>(random.uniform(-jitter_ms, jitter_ms) * kMs));
  return out;
}

double delay_ms(const CapturePhase& phase) { return static_cast<double>(phase.later_ns) / kMs; }

TEST(CapturePhase, IsTheTypicalDelay) {
  for (const int delay : {0, 12, 23, 25, 27, -12}) {
    const auto found = capture_phase(images(200, 50, 100, 0, 1), images(200, 50, 100 + delay, 4, 2), 50 * kMs);
    ASSERT_TRUE(found) << delay;
    EXPECT_TRUE(found->constant) << delay;
    EXPECT_NEAR(static_cast<double>(wrapped(found->later_ns - delay * kMs, 50 * kMs)) / kMs, 0, 1) << delay;
  }
}

TEST(CapturePhase, DoesNotDependOnTheFirstImage) {
  for (const int delay : {15, 23, 24, 25, 26}) {
    for (const int displaced : {-20, -10, 10, 20}) {
      std::vector<TimeNs> times = images(200, 50, 100 + delay, 4, 3);
      times.front() += displaced * kMs;
      const auto found = capture_phase(images(200, 50, 100, 0, 1), times, 50 * kMs);
      ASSERT_TRUE(found) << delay;
      EXPECT_TRUE(found->constant) << delay << " " << displaced;
    }
  }
}

TEST(CapturePhase, IsNotConstantForAnotherRate) {
  const auto found = capture_phase(images(200, 50, 100, 0, 1), images(240, 41, 100, 0, 2), 50 * kMs);
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->constant);
}

TEST(CapturePhase, OfASlowerCameraIsThatOfItsImagesDuringThoseOfCamera0) {
  const auto found = capture_phase(images(17, 33, 1'100, 0, 1), images(17, 99, 12, 1, 2), 33 * kMs);
  ASSERT_TRUE(found);  // six of the 17 images
  EXPECT_TRUE(found->constant);
}

TEST(CapturePhase, IsUnknownForTooFewImages) {
  EXPECT_FALSE(capture_phase(images(200, 50, 0, 0, 1), images(4, 50, 0, 0, 2), 50 * kMs));
  EXPECT_FALSE(capture_phase(images(4, 50, 0, 0, 1), images(200, 50, 0, 0, 2), 50 * kMs));
}

// Of a camera that captured late by 12 ms before.
CapturePhase phase_after(std::vector<TimeNs> times) {
  const std::vector<CapturePhase> before = {{}, {.constant = true, .later_ns = 12 * kMs}};
  return capture_phases(std::vector{images(17, 50, 0, 0, 1), std::move(times)}, 2 * kMs, before).cameras[1];
}

TEST(CapturePhases, RemainWhileTheyAreNotContradicted) {
  EXPECT_EQ(delay_ms(phase_after(images(17, 50, 14, 2, 2))), 12);
  EXPECT_EQ(delay_ms(phase_after(images(3, 50, 30, 0, 2))), 12) << "too few images to decide";
  EXPECT_NEAR(delay_ms(phase_after(images(17, 50, 30, 0, 2))), -20, 1e-9);
  EXPECT_EQ(delay_ms(phase_after(images(17, 50, 1, 0, 2))), 0) << "within the tolerance of camera 0";
  EXPECT_FALSE(phase_after(images(20, 41, 0, 0, 2)).constant);
}

// Of a live camera with a slightly longer period, whose delay grows by 1 ms in two images.
TEST(CapturePhases, OfADriftingDelayAreThatOfTheNewestImages) {
  const auto camera0 = images(17, 50, 0, 0, 1);
  std::vector<TimeNs> times;
  for (int k = 0; k < 17; ++k) times.push_back((50 * k + 6 + k / 2) * kMs);
  const auto live = [&](int former_ms) {
    const std::vector<CapturePhase> before = {{}, {.constant = true, .later_ns = former_ms * kMs}};
    return delay_ms(capture_phases(std::vector{camera0, times}, 2 * kMs, before).cameras[1]);
  };
  EXPECT_NEAR(live(9), 14, 1) << "not 10, that of the middle image";
  EXPECT_NEAR(delay_ms(capture_phases(std::vector{camera0, times}, 2 * kMs).cameras[1]), 10, 1) << "of a recording";
}

TEST(CapturePhases, WidenTheToleranceWhileAnyIsConstant) {
  const std::vector<CapturePhase> before = {{}, {.constant = true, .later_ns = 0}};
  const auto tolerance = [&](const std::vector<TimeNs>& times, std::span<const CapturePhase> former) {
    return capture_phases(std::vector{images(17, 50, 0, 0, 1), times}, 2 * kMs, former).tolerance_ns;
  };
  EXPECT_EQ(tolerance(images(17, 50, 0, 3, 2), {}), 5 * kMs);
  EXPECT_EQ(tolerance(images(3, 50, 0, 3, 2), before), 5 * kMs);
  EXPECT_EQ(tolerance(images(3, 50, 0, 3, 2), {}), 2 * kMs);
  EXPECT_EQ(tolerance(images(20, 41, 0, 0, 2), before), 2 * kMs);
}

}  // namespace
}  // namespace bslam::image
