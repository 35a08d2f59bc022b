#include "base/exact_seconds.h"

#include <gtest/gtest.h>

#include <limits>

namespace bslam {
namespace {

TEST(ExactSeconds, HaveEveryNanosecond) {
  EXPECT_EQ(exact_seconds(1'000'000'000'000'000'119), "1000000000.000000119");
  EXPECT_EQ(exact_seconds(0), "0.000000000");
  EXPECT_EQ(exact_seconds(-1), "-0.000000001");
  EXPECT_EQ(exact_seconds(-1'500'000'000), "-1.500000000");
  EXPECT_EQ(exact_seconds(std::numeric_limits<TimeNs>::min()), "-9223372036.854775808");
}

}  // namespace
}  // namespace bslam
