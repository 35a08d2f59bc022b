#include "session/run_control.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace bslam::session {
namespace {

using Clock = std::chrono::steady_clock;
constexpr TimeNs kSecond = 1'000'000'000;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

TEST(SessionRunControl, FramesAreFedAtOnceOrAtTheirPace) {
  RunControl control;
  const auto start = Clock::now();
  for (int i = 0; i < 100; ++i) control.wait_for(i * kSecond, {});
  EXPECT_LT(seconds_since(start), 10.0);
  EXPECT_EQ(control.lateness_s(0), 0);

  RunControl paced(10.0);
  const auto paced_start = Clock::now();
  for (int i = 0; i < 4; ++i) paced.wait_for(i * kSecond, {});
  EXPECT_GE(seconds_since(paced_start), 0.3);
  EXPECT_GT(paced.lateness_s(2 * kSecond), 0);
  EXPECT_EQ(paced.lateness_s(1000 * kSecond), 0);
}

// Two recordings in one, a clock that was set, and a pause are not waited for; the frames after them keep their pace.
TEST(SessionRunControl, AJumpOfTheClockIsNotWaitedFor) {
  RunControl control(10.0);
  std::stop_source stop;
  std::jthread limit([&stop](const std::stop_token& over) {
    for (int k = 0; k < 200 && !over.stop_requested(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(100));
    stop.request_stop();
  });
  for (const TimeNs start : {TimeNs{0}, 1'700'000'000 * kSecond, 1'700'000'100 * kSecond, TimeNs{0}}) {
    const auto begin = Clock::now();
    EXPECT_TRUE(control.wait_for(start, stop.get_token()));
    EXPECT_TRUE(control.wait_for(start + kSecond, stop.get_token()));
    EXPECT_GE(seconds_since(begin), 0.1);
  }
  RunControl slow(RunControl::kMinSpeed);
  slow.wait_for(0, {});
  EXPECT_EQ(slow.lateness_s(9'000'000'000 * kSecond), 0);
}

TEST(SessionRunControl, AStepLetsOneFramePass) {
  RunControl control;
  control.step();
  control.step();
  EXPECT_TRUE(control.state().paused);
  std::stop_source stop;
  stop.request_stop();  // so that a frame that may not pass is not waited for
  EXPECT_TRUE(control.wait_for(0, stop.get_token()));
  EXPECT_TRUE(control.wait_for(kSecond, stop.get_token()));
  EXPECT_FALSE(control.wait_for(2 * kSecond, stop.get_token()));
  bool passed = false;
  std::jthread feeder([&] { passed = control.wait_for(2 * kSecond, {}); });
  control.resume();
  feeder.join();
  EXPECT_TRUE(passed);
  EXPECT_FALSE(control.state().paused);
}

TEST(SessionRunControl, AStopEndsEveryWait) {
  RunControl paused, slow(RunControl::kMinSpeed);
  paused.pause();
  slow.wait_for(0, {});
  std::stop_source stop;
  std::jthread first([&] { paused.wait_for(0, stop.get_token()); });
  std::jthread second([&] { slow.wait_for(50 * kSecond, stop.get_token()); });
  stop.request_stop();
}

TEST(SessionRunControl, AnotherSpeedEndsTheWaitForTheFormer) {
  RunControl control(RunControl::kMinSpeed);
  control.wait_for(0, {});
  std::jthread feeder([&] { control.wait_for(50 * kSecond, {}); });
  control.set_speed(0);
  feeder.join();
  for (const double wrong : {-1.0, 1e-9, 1e9}) control.set_speed(wrong);
  EXPECT_EQ(control.state().speed, 0);
}

}  // namespace
}  // namespace bslam::session
