#include "dataset/frame_grouping.h"

#include <gtest/gtest.h>

#include "base/random.h"

namespace bslam::dataset {
namespace {

constexpr TimeNs kMs = 1'000'000;

std::vector<image_files::ImageFile> at_ms(const std::vector<double>& times_ms) {
  std::vector<image_files::ImageFile> images;
  for (const double t : times_ms) images.push_back({"", static_cast<TimeNs>(t * 1e6)});
  return images;
}

// Per frame, the times of its images in ms; -1 = none.
std::vector<std::vector<double>> times(const FrameGrouping& grouping) {
  std::vector<std::vector<double>> out;
  for (const FrameEntry& frame : grouping.frames) {
    out.emplace_back();
    for (const auto& image : frame.images) out.back().push_back(image ? static_cast<double>(image->time_ns) / 1e6 : -1);
  }
  return out;
}

FrameGrouping group(const std::vector<std::vector<image_files::ImageFile>>& images) {
  return group_frames(images, 2 * kMs);
}

TEST(FrameGrouping, JoinsImagesWithinTheToleranceAndKeepsTheirTimes) {
  const auto g = group({at_ms({0, 100, 200}), at_ms({0.5, 99, 202}), at_ms({1.9, 100, 199})});
  EXPECT_EQ(times(g), (std::vector<std::vector<double>>{{0, 0.5, 1.9}, {100, 99, 100}, {200, 202, 199}}));
  EXPECT_EQ(g.frames[1].time_ns, 100 * kMs);
  EXPECT_EQ(g.beside_camera0, (std::vector<int>{0, 0, 0}));
}

TEST(FrameGrouping, ImagesAtOtherTimesAreFramesOfTheirOwn) {
  const auto g = group({at_ms({0, 100, 200}), at_ms({10, 101, 150, 190})});
  EXPECT_EQ(times(g),
            (std::vector<std::vector<double>>{{0, -1}, {-1, 10}, {100, 101}, {-1, 150}, {-1, 190}, {200, -1}}));
  EXPECT_EQ(g.beside_camera0, (std::vector<int>{0, 3}));
  EXPECT_EQ(g.shared_with_camera0, (std::vector<int>{3, 1}));
}

TEST(FrameGrouping, AFasterCameraHasFramesOfItsOwn) {
  const auto g = group({at_ms({0, 50, 100, 150}), at_ms({0, 33, 67, 100, 133})});
  EXPECT_EQ(times(g),
            (std::vector<std::vector<double>>{{0, 0}, {-1, 33}, {50, -1}, {-1, 67}, {100, 100}, {-1, 133}, {150, -1}}));
  EXPECT_EQ(g.beside_camera0[1], 3);
}

TEST(FrameGrouping, ImagesAtTheTimesOfLostOnesOfCamera0AreFrames) {
  const auto g = group({at_ms({0, 150, 200, 350}), at_ms({50, 100.5, 200, 250}), at_ms({100, 150.5, 300})});
  EXPECT_EQ(times(g), (std::vector<std::vector<double>>{{0, -1, -1},
                                                        {-1, 50, -1},
                                                        {-1, 100.5, 100},
                                                        {150, -1, 150.5},
                                                        {200, 200, -1},
                                                        {-1, 250, -1},
                                                        {-1, -1, 300},
                                                        {350, -1, -1}}));
}

TEST(FrameGrouping, ConstantDelaysWithinTheToleranceStayTogetherWithLostImages) {
  const auto g =
      group_frames(std::vector{at_ms({0, 50, 150}), at_ms({0, 100, 150}), at_ms({15, 65, 115, 165})}, 20 * kMs);
  EXPECT_EQ(times(g), (std::vector<std::vector<double>>{{0, 0, 15}, {50, -1, 65}, {-1, 100, 115}, {150, 150, 165}}));
}

TEST(FrameGrouping, AlternatingCamerasAlternateInTheFrames) {
  const auto g = group({at_ms({0, 100, 200}), at_ms({50, 150})});
  EXPECT_EQ(times(g), (std::vector<std::vector<double>>{{0, -1}, {-1, 50}, {100, -1}, {-1, 150}, {200, -1}}));
}

// Random rates, delays, jitter and losses: the properties that every grouping has.
TEST(FrameGrouping, EveryImageIsInOneFrameInOrderOfTime) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<std::vector<image_files::ImageFile>> images(1 + random.below(4));
    for (auto& camera : images) {
      const TimeNs interval = (20 + random.below(40)) * kMs, delay = random.below(30) * kMs;
      const std::uint32_t lost = random.below(10);
      for (int k = 0; k < 60; ++k) {
        const TimeNs jitter = random.below(6) * kMs;
        if (camera.empty() || random.below(10) >= lost) camera.push_back({"", k * interval + delay + jitter});
      }
    }
    const FrameGrouping g = group_frames(images, random.below(25) * kMs);
    std::vector<std::vector<TimeNs>> grouped(images.size());
    for (std::size_t k = 0; k < g.frames.size(); ++k) {
      if (k > 0) {
        EXPECT_GT(g.frames[k].time_ns, g.frames[k - 1].time_ns);
      }
      for (std::size_t c = 0; c < images.size(); ++c) {
        if (g.frames[k].images[c]) grouped[c].push_back(g.frames[k].images[c]->time_ns);
      }
    }
    for (std::size_t c = 0; c < images.size(); ++c) {
      std::vector<TimeNs> expected;
      for (const auto& image : images[c]) expected.push_back(image.time_ns);
      EXPECT_EQ(grouped[c], expected) << "trial " << trial << ", camera " << c;
    }
  }
}

TEST(FrameGrouping, OtherCamerasDefineFramesInAGapOfCamera0) {
  const auto g = group({at_ms({0, 100, 500}), at_ms({0, 100, 200, 300, 400, 500, 600}), at_ms({301, 600.5})});
  EXPECT_EQ(
      times(g),
      (std::vector<std::vector<double>>{
          {0, 0, -1}, {100, 100, -1}, {-1, 200, -1}, {-1, 300, 301}, {-1, 400, -1}, {500, 500, -1}, {-1, 600, 600.5}}));
  const auto h = group(
      {at_ms({0, 100, 200, 300, 700, 800}), at_ms({0, 100, 200, 300, 400, 500, 600, 700}), at_ms({300, 499, 900})});
  EXPECT_EQ(times(h), (std::vector<std::vector<double>>{{0, 0, -1},
                                                        {100, 100, -1},
                                                        {200, 200, -1},
                                                        {300, 300, 300},
                                                        {-1, 400, -1},
                                                        {-1, 500, 499},
                                                        {-1, 600, -1},
                                                        {700, 700, -1},
                                                        {800, -1, -1},
                                                        {-1, -1, 900}}));
  EXPECT_EQ(h.frames[5].time_ns, 499 * kMs);
}

TEST(FrameGrouping, TheNearerOfTwoImagesJoinsCamera0) {
  const auto g = group({at_ms({0, 100}), at_ms({-1.5, 0.5, 99, 100.5})});
  EXPECT_EQ(times(g), (std::vector<std::vector<double>>{{-1, -1.5}, {0, 0.5}, {-1, 99}, {100, 100.5}}));
  EXPECT_EQ(g.beside_camera0[1], 2);
  EXPECT_EQ(g.shared_with_camera0[1], 2);
}

TEST(FrameGrouping, OneImageOfCamera0IsEnough) {
  const auto g = group({at_ms({50}), at_ms({49, 200})});
  EXPECT_EQ(times(g), (std::vector<std::vector<double>>{{50, 49}, {-1, 200}}));
}

TEST(FrameGrouping, OneCameraKeepsEveryImage) {
  const auto g = group({at_ms({0, 1, 2, 50})});
  EXPECT_EQ(g.frames.size(), 4u);
}

std::vector<double> every_ms(double first, double period, int count, double jitter = 0, std::uint64_t seed = 1) {
  Random random(seed);
  std::vector<double> out;
  for (int k = 0; k < count; ++k) out.push_back(first + period * k + random.uniform(-jitter, jitter));
  return out;
}

TEST(FrameGrouping, CamerasThatTakeTurnsShareFrames) {
  for (const double phase : {20.0, 50.0, -30.0}) {
    const auto g = group({at_ms(every_ms(100, 100, 40, 2)), at_ms(every_ms(100 + phase, 100, 40, 2, 2))});
    EXPECT_GE(g.shared_with_camera0[1], 39) << phase;
    EXPECT_LE(g.frames.size(), 41u) << phase;
    TimeNs last_ns = -1;
    for (const FrameEntry& frame : g.frames) {
      EXPECT_GT(frame.time_ns, last_ns);
      last_ns = frame.time_ns;
      if (!frame.images[0] || !frame.images[1]) continue;
      const double later_ms = static_cast<double>(frame.images[1]->time_ns - frame.images[0]->time_ns) / 1e6;
      EXPECT_NEAR(phase == 50 ? std::abs(later_ms) : later_ms, phase, 5);
    }
  }
}

TEST(FrameGrouping, AConstantDelayIsFoundDespiteLostImages) {
  std::vector<double> camera0 = every_ms(0, 50, 60), camera1 = every_ms(20, 50, 60);
  Random random(3);
  std::erase_if(camera0, [&](double) { return random.uniform() < 0.3; });
  std::erase_if(camera1, [&](double) { return random.uniform() < 0.3; });
  const auto g = group({at_ms(camera0), at_ms(camera1)});
  for (const FrameEntry& frame : g.frames) {
    if (!frame.images[0] || !frame.images[1]) continue;
    EXPECT_EQ(frame.images[1]->time_ns - frame.images[0]->time_ns, 20 * kMs);
  }
  EXPECT_GT(g.shared_with_camera0[1], 20);
}

TEST(FrameGrouping, LostImagesAndOtherRatesAreNoConstantDelay) {
  std::vector<double> camera0 = every_ms(0, 50, 200), camera1 = camera0;
  Random random(3);
  std::erase_if(camera0, [&](double) { return random.uniform() < 0.8; });
  std::erase_if(camera1, [&](double) { return random.uniform() < 0.8; });
  for (const auto& [a, b] : {std::pair(camera0, camera1), std::pair(every_ms(0, 50, 60), every_ms(0, 33.3, 90)),
                             std::pair(every_ms(0, 50, 60), every_ms(10, 25, 120))}) {
    for (const FrameEntry& frame : group({at_ms(a), at_ms(b)}).frames) {
      if (!frame.images[0] || !frame.images[1]) continue;
      EXPECT_LE(std::abs(frame.images[1]->time_ns - frame.images[0]->time_ns), 2 * kMs);
    }
  }
}

// The others fire one after the other; camera 0 accompanies every fourth of their images, or has a rate of its own.
TEST(FrameGrouping, FasterCamerasShareFramesWhateverTheRateOfCamera0) {
  for (const double period : {200.0, 123.4}) {
    const auto g = group({at_ms(every_ms(7, period, 40, 1)), at_ms(every_ms(0, 50, 160, 1, 2)),
                          at_ms(every_ms(12, 50, 160, 1, 3)), at_ms(every_ms(24, 50, 160, 1, 4))});
    int common = 0;
    for (const FrameEntry& frame : g.frames) {
      if (!frame.images[1] || !frame.images[2] || !frame.images[3]) continue;
      ++common;
      EXPECT_NEAR(static_cast<double>(frame.images[2]->time_ns - frame.images[1]->time_ns) / 1e6, 12, 2);
      EXPECT_NEAR(static_cast<double>(frame.images[3]->time_ns - frame.images[1]->time_ns) / 1e6, 24, 2);
    }
    EXPECT_GE(common, 150) << period;
    EXPECT_LE(g.frames.size(), 210u) << period;
  }
}

TEST(FrameGrouping, CamerasShareFramesWithoutCamera0) {
  const auto g = group({at_ms({0}), at_ms(every_ms(0, 50, 40)), at_ms(every_ms(20, 50, 40))});
  EXPECT_LE(g.frames.size(), 41u);
}

}  // namespace
}  // namespace bslam::dataset
