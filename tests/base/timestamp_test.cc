#include "base/timestamp.h"

#include <gtest/gtest.h>

namespace bslam {
namespace {

TEST(Timestamp, RoundsSecondsToTheNearestNanosecond) {
  EXPECT_EQ(from_seconds(0.05), 50'000'000);
  EXPECT_EQ(from_seconds(-0.05), -50'000'000);
  EXPECT_EQ(from_seconds(1e-9), 1);
  EXPECT_EQ(from_seconds(0.0), 0);
  EXPECT_DOUBLE_EQ(to_seconds(1'500'000'000), 1.5);
}

TEST(Timestamp, RoundTripsThroughSeconds) {
  for (const TimeNs t : {TimeNs{0}, TimeNs{1}, TimeNs{-1}, TimeNs{123456789}, TimeNs{3'600'000'000'001}}) {
    EXPECT_EQ(from_seconds(to_seconds(t)), t);
  }
}

}  // namespace
}  // namespace bslam
