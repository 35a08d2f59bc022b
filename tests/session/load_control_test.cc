#include "session/load_control.h"

#include <gtest/gtest.h>

namespace bslam::session {
namespace {

constexpr TimeNs kInterval = 50'000'000;

// Levels after `frames` more frames that are all late by `behind` frames; `now` is advanced.
int after(LoadControl& control, int frames, double behind, TimeNs& now, TimeNs interval_ns = kInterval) {
  int level = 0;
  for (int i = 0; i < frames; ++i) level = control.update(behind, behind * to_seconds(interval_ns), now += interval_ns);
  return level;
}

TEST(SessionLoadControl, KeepsAllWorkWhileFramesAreInTime) {
  LoadControl control;
  TimeNs now = 0;
  EXPECT_EQ(after(control, 1000, 0.9, now), 0);
}

// At 200 Hz, a few frames are not late, and one or two are in time.
TEST(SessionLoadControl, DoesNotMistakeAHighRateForALoad) {
  constexpr TimeNs kShort = 5'000'000;
  LoadControl control;
  TimeNs now = 0;
  EXPECT_EQ(after(control, 1000, 9, now, kShort), 0);
  EXPECT_EQ(after(control, 2, 12, now, kShort), 1);
  EXPECT_EQ(after(control, 380, 2, now, kShort), 1);
  EXPECT_EQ(after(control, 30, 2, now, kShort), 0);
}

TEST(SessionLoadControl, ReducesTheWorkStepByStep) {
  LoadControl control;
  TimeNs now = 0;
  EXPECT_EQ(after(control, 1, 1.5, now), 0);  // a single frame
  EXPECT_EQ(after(control, 1, 1.5, now), 1);
  EXPECT_EQ(after(control, 4, 1.5, now), 1);  // the first step has had no effect yet
  EXPECT_EQ(after(control, 1, 1.5, now), 2);
  EXPECT_EQ(after(control, 100, 1.5, now), kMaxReduction);
}

TEST(SessionLoadControl, DoesAllWorkAgainAfterAWhile) {
  LoadControl control;
  TimeNs now = 0;
  after(control, 7, 2, now);
  EXPECT_EQ(after(control, 30, 0.5, now), 2);  // in time, but not by much
  EXPECT_EQ(after(control, 39, 0, now), 2);
  EXPECT_EQ(after(control, 2, 0, now), 1);
  EXPECT_EQ(after(control, 41, 0, now), 0);
}

TEST(SessionLoadControl, WaitsLongerIfTheLoadReturnsAtOnce) {
  LoadControl control;
  TimeNs now = 0;
  after(control, 2, 2, now);
  EXPECT_EQ(after(control, 41, 0, now), 0);
  EXPECT_EQ(after(control, 2, 2, now), 1);
  EXPECT_EQ(after(control, 60, 0, now), 1);
  EXPECT_EQ(after(control, 21, 0, now), 0);
}

}  // namespace
}  // namespace bslam::session
