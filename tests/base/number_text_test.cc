#include "base/number_text.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "base/random.h"

namespace bslam {
namespace {

TEST(NumberText, ReadsFiniteNumbersOnly) {
  EXPECT_EQ(parse_double("1"), 1.0);
  EXPECT_EQ(parse_double("-2.5e-3"), -2.5e-3);
  EXPECT_EQ(parse_double("+.5"), 0.5);
  for (const char* text :
       {"", " ", "1 ", "nan", ".nan", "inf", "-inf", "1e999", "1,5", "0x10", "1.0.0", "+-1", "one"}) {
    EXPECT_FALSE(parse_double(text)) << text;
  }
}

TEST(NumberText, ReadsIntegersThatFit) {
  EXPECT_EQ(parse_integer("-17"), -17);
  EXPECT_EQ(parse_integer("9223372036854775807"), std::numeric_limits<std::int64_t>::max());
  for (const char* text : {"", "1.0", "1e3", "9223372036854775808", "0x1", "1_000", "then"})
    EXPECT_FALSE(parse_integer(text));
}

TEST(NumberText, DoublesRoundTripExactly) {
  Random random(1);
  for (int i = 0; i < 20000; ++i) {
    const double value = std::bit_cast<double>(random.next());
    if (!std::isfinite(value)) continue;
    const std::string text = format_double(value);
    ASSERT_NE(text.find('.'), std::string::npos) << text;
    ASSERT_EQ(std::bit_cast<std::uint64_t>(parse_double(text).value()), std::bit_cast<std::uint64_t>(value)) << text;
  }
  EXPECT_EQ(format_double(0.1), "0.1");
  EXPECT_EQ(format_double(1), "1.0");
  EXPECT_EQ(format_double(1e-20), "1.0e-20");
}

}  // namespace
}  // namespace bslam
