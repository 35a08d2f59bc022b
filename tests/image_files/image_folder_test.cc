#include "image_files/image_folder.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace bslam::image_files {
namespace {

ImageList sorted(const std::vector<TimeNs>& stamps, StampUnit unit = StampUnit::kOfFile) {
  std::vector<ImageFile> images;
  for (const TimeNs stamp : stamps) images.push_back({"image.png", stamp});
  return in_time_order(std::move(images), "cam0", unit);
}

TEST(TimeOrder, StepsBackAreCountedAndTheFirstIsNamed) {
  const ImageList list = sorted({100, 150, 120, 200, 250, 240});
  ASSERT_EQ(list.warnings.size(), 1u);
  EXPECT_EQ(list.warnings[0], "cam0: time stamps step back 2 times, first from 150 to 120; images have been sorted");
  EXPECT_EQ(list.images[1].time_ns, 120);
  EXPECT_EQ(sorted({1'500'000'000, 1'250'000'000}, StampUnit::kSeconds).warnings[0],
            "cam0: time stamps step back 1 time, first from 1.500000000 s to 1.250000000 s; images have been sorted");
  EXPECT_EQ(sorted({1'000'000'000'000'000'119, 1'000'000'000'000'000'003}, StampUnit::kSeconds).warnings[0],
            "cam0: time stamps step back 1 time, first from 1000000000.000000119 s to 1000000000.000000003 s; images "
            "have been sorted");
  EXPECT_TRUE(sorted({1, 2, 3}).warnings.empty());
}

// Stamps of `count` images from `first` on, `interval` apart.
void append(std::vector<TimeNs>& stamps, TimeNs first, TimeNs interval, int count) {
  for (int k = 0; k < count; ++k) stamps.push_back(first + k * interval);
}

TEST(TimeOrder, ImagesOfTimesThatTheClockPassesTwiceAreNotMixed) {
  for (const TimeNs step : {230, 245, 300, 1200, 2600}) {  // the last by more than the rest of the recording
    std::vector<TimeNs> stamps;
    append(stamps, 10'000, 50, 60);
    std::swap(stamps[20], stamps[21]);  // messages that overtook each other are no step of the clock
    append(stamps, stamps.back() + 50 - step, 50, 40);
    const ImageList list = sorted(stamps);
    const auto removed = std::ranges::count_if(stamps.begin() + 60, stamps.end(), [](TimeNs t) { return t <= 12'950; });
    EXPECT_EQ(list.images.size(), 100u - static_cast<std::size_t>(removed)) << step;
    EXPECT_EQ(list.warnings[0], fmt::format("cam0: the clock was set back during the recording; {} images with times "
                                            "that had been before are not used",
                                            removed));
    EXPECT_TRUE(std::ranges::is_sorted(list.images, {}, &ImageFile::time_ns));
  }
}

TEST(TimeOrder, EveryStepOfTheClockIsSaid) {
  std::vector<TimeNs> stamps;
  append(stamps, 10'000, 50, 40);
  append(stamps, 11'520, 50, 40);
  append(stamps, 12'770, 50, 40);
  const ImageList list = sorted(stamps);
  EXPECT_EQ(std::ranges::count_if(list.warnings,
                                  [](const std::string& w) { return w.find("set back") != std::string::npos; }),
            2);
  EXPECT_EQ(list.warnings.size(), 2u);
}

TEST(TimeOrder, ImagesThatAreListedInPartsAreAllUsed) {
  std::vector<TimeNs> two_writers, resent, shuffled;
  append(two_writers, 10'000, 100, 30);
  append(two_writers, 10'050, 100, 30);
  append(resent, 10'000, 50, 20);
  append(resent, 11'500, 50, 20);
  append(resent, 11'000, 50, 10);
  append(shuffled, 10'000, 50, 60);
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(1));
  for (const auto& stamps : {two_writers, resent, shuffled}) {
    const ImageList list = sorted(stamps);
    EXPECT_EQ(list.images.size(), stamps.size());
    EXPECT_TRUE(std::ranges::is_sorted(list.images, {}, &ImageFile::time_ns));
  }
}

TEST(TimeOrder, ImagesWithTheStampOfAnotherAreCounted) {
  const ImageList list = sorted({100, 100, 150, 150, 150});
  EXPECT_EQ(list.images.size(), 2u);
  EXPECT_EQ(list.warnings,
            (std::vector<std::string>{"cam0: 3 images with the time stamp of another image are not used"}));
}

TEST(TimeOrder, ZerosFarFromAllOthersAreDamaged) {
  const TimeNs first = 1'403'636'579'763'555'584, interval = 50'000'000;
  for (const std::size_t place : {0, 2, 4}) {
    std::vector<TimeNs> stamps = {first, first + interval, first + 2 * interval, first + 3 * interval};
    stamps.insert(stamps.begin() + static_cast<std::ptrdiff_t>(place), 0);
    const ImageList list = sorted(stamps);
    EXPECT_EQ(list.images.size(), 4u);
    EXPECT_EQ(list.warnings, (std::vector<std::string>{"cam0: 1 image has the damaged time stamp 0 and is not used"}));
  }
}

TEST(TimeOrder, ZerosAtTheBeginningAreStamps) {
  EXPECT_EQ(sorted({0, 1, 2}).images.size(), 3u);
  EXPECT_EQ(sorted({100, 0, 50}).images.size(), 3u);           // not sorted
  EXPECT_EQ(sorted({0, 5000, 5050, 5100}).images.size(), 4u);  // a pause after the first image
  EXPECT_EQ(sorted({0}).images.size(), 1u);
}

}  // namespace
}  // namespace bslam::image_files
