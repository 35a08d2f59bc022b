#include "capture/silence.h"

#include <gtest/gtest.h>

namespace bslam::capture {
namespace {

using std::chrono::milliseconds;

constexpr Silence::Clock::time_point kOpened{};

TEST(CaptureSilence, TheFirstImageMayTakeLonger) {
  Silence silence({}, kOpened);
  EXPECT_FALSE(silence.exceeded(20, kOpened + milliseconds(9'900)));
  EXPECT_EQ(silence.exceeded(20, kOpened + milliseconds(10'100)), Silence::Seconds(10));
  silence.image(kOpened + milliseconds(9'000));
  EXPECT_FALSE(silence.exceeded(20, kOpened + milliseconds(10'900)));
  EXPECT_EQ(silence.exceeded(20, kOpened + milliseconds(11'100)), Silence::Seconds(2));
  silence.opened(kOpened + milliseconds(12'000));
  EXPECT_FALSE(silence.exceeded(20, kOpened + milliseconds(21'900)));
}

TEST(CaptureSilence, SlowCamerasHaveThreeIntervals) {
  Silence silence({}, kOpened);
  EXPECT_FALSE(silence.exceeded(0.25, kOpened + milliseconds(11'900)));
  silence.image(kOpened);
  EXPECT_FALSE(silence.exceeded(0.25, kOpened + milliseconds(11'900)));
  EXPECT_EQ(silence.exceeded(0.25, kOpened + milliseconds(12'100)), Silence::Seconds(12));
}

TEST(CaptureSilence, AnUnknownIntervalIsMeasured) {
  Silence silence({}, kOpened);
  silence.image(kOpened);
  EXPECT_FALSE(silence.exceeded({}, kOpened + milliseconds(9'900)));
  silence.image(kOpened + milliseconds(4'000));
  EXPECT_FALSE(silence.exceeded({}, kOpened + milliseconds(15'900)));
  EXPECT_EQ(silence.exceeded({}, kOpened + milliseconds(16'100)), Silence::Seconds(12));
}

}  // namespace
}  // namespace bslam::capture
