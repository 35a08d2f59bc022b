#include "dataset/time_stamps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

namespace bslam::dataset {
namespace {

// Time stamps of images `interval` apart.
std::vector<image_files::ImageFile> images_at(TimeNs first, TimeNs interval, int count = 20) {
  std::vector<image_files::ImageFile> images;
  for (int k = 0; k < count; ++k) images.push_back({"image.png", first + k * interval});
  return images;
}

constexpr TimeNs kMillisecond = 1'000'000;

TEST(TimeStamps, NanosecondsAreKept) {
  for (const TimeNs interval : {kMillisecond, 50 * kMillisecond, 10'000 * kMillisecond}) {
    auto images = images_at(1'403'636'579'763'555'584, interval);
    ASSERT_TRUE(convert_time_stamps({}, "cam0", images));
    EXPECT_EQ(images[3].time_ns, 1'403'636'579'763'555'584 + 3 * interval);
  }
  auto one = images_at(7, 1, 1);
  EXPECT_TRUE(convert_time_stamps({}, "cam0", one));
}

// Image numbers, milliseconds and microseconds are recognised, and the error names the option that fits.
TEST(TimeStamps, OtherUnitsAreAskedFor) {
  for (const auto& [interval, option] : {std::pair<TimeNs, const char*>(1, "--rate HZ if"),
                                         {5, "--rate HZ if"},
                                         {33, "--stamp-unit ms if"},
                                         {1000, "--stamp-unit ms if"},
                                         {33'333, "--stamp-unit us if"},
                                         {200'000, "--stamp-unit us if"}}) {
    auto images = images_at(1000, interval);
    const Status status = convert_time_stamps({}, "data/cam0", images);
    ASSERT_FALSE(status) << interval;
    EXPECT_NE(status.error().message().find(option), std::string::npos) << status.error().message();
    EXPECT_TRUE(status.error().message().starts_with("data/cam0: ")) << status.error().message();
  }
}

TEST(TimeStamps, UnitsAreConvertedExactly) {
  auto images = images_at(1'403'636'579'763, 50);
  ASSERT_TRUE(convert_time_stamps({.unit_ns = kMillisecond}, "cam0", images));
  EXPECT_EQ(images[1].time_ns, 1'403'636'579'813 * kMillisecond);
  auto fast = images_at(0, 1);
  ASSERT_TRUE(convert_time_stamps({.unit_ns = 1}, "cam0", fast));
  EXPECT_EQ(fast[5].time_ns, 5);
}

// A missing image leaves a gap, and rounding does not add up.
TEST(TimeStamps, NumbersAtARate) {
  std::vector<image_files::ImageFile> images = {{"1.png", 1}, {"3.png", 3}, {"3000000.png", 3'000'000}};
  ASSERT_TRUE(convert_time_stamps({.rate_hz = 30}, "cam0", images));
  EXPECT_EQ(images[0].time_ns, 33'333'333);
  EXPECT_EQ(images[1].time_ns, 100 * kMillisecond);
  EXPECT_EQ(images[2].time_ns, 100'000'000 * kMillisecond);
}

// A unit that makes a camera impossibly fast or slow is asked about like none.
TEST(TimeStamps, AWrongUnitIsAskedAbout) {
  const TimeNs us = 1000, ms = kMillisecond, s = 1000 * kMillisecond;
  for (const auto& [interval, unit, proposal] : {std::tuple<TimeNs, TimeNs, const char*>(1, us, "--rate HZ if"),
                                                 {50, us, "--stamp-unit ms if"},
                                                 {50'000'000, us, "no --stamp-unit if they are nanoseconds"},
                                                 {50'000, ms, "--stamp-unit us if"},
                                                 {50, s, "--stamp-unit ms if"}}) {
    auto images = images_at(1000, interval);
    const Status status = convert_time_stamps({.unit_ns = unit}, "data/cam0", images);
    ASSERT_FALSE(status) << interval << " " << unit;
    EXPECT_NE(status.error().message().find(proposal), std::string::npos) << status.error().message();
  }
  auto stamps = images_at(1000, 50'000'000), numbers = images_at(0, 1), slow = images_at(0, 1);
  EXPECT_FALSE(convert_time_stamps({.rate_hz = 20}, "cam0", stamps));
  EXPECT_TRUE(convert_time_stamps({.rate_hz = 0.01}, "cam0", slow));
  EXPECT_TRUE(convert_time_stamps({.unit_ns = s}, "cam0", numbers));
}

TEST(TimeStamps, RejectsValuesOutOfRange) {
  auto images = images_at(1'403'636'579'763'555'584, 50 * kMillisecond);
  EXPECT_EQ(convert_time_stamps({.unit_ns = 1000}, "cam0", images).error().key, "--stamp-unit");
  EXPECT_EQ(convert_time_stamps({.unit_ns = 1000}, "cam0", images).error().message(),
            "cam0: --stamp-unit: found time stamp 1403636579763555584, which is too large for this unit, expected time "
            "stamps in this unit; those in nanoseconds need no option");
  EXPECT_EQ(convert_time_stamps({.rate_hz = 20}, "cam0", images).error().key, "--rate");
  for (const double rate : {0.0, -1.0, 1e9, std::nan("")})
    EXPECT_EQ(convert_time_stamps({.rate_hz = rate}, "cam0", images).error().file, "--rate");
  EXPECT_FALSE(convert_time_stamps({.rate_hz = 20, .unit_ns = 1}, "cam0", images));
}

}  // namespace
}  // namespace bslam::dataset
