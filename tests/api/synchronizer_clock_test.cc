// Clocks that step, start wrong or run at slightly different rates.
#include <bslam/synchronizer.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "api/live_feed.h"
#include "base/random.h"

namespace bslam {
namespace {

using testing::Feed;
using testing::kMs;
using testing::regular;
using testing::Shot;

constexpr std::int64_t kStepAt = 10'000, kReturnAt = 20'000, kEnd = 30'000;  // ms

// Eight or fewer cameras at 20 Hz, of which the clock of one is ahead by `step_ms` for ten seconds. Images arrive up
// to `latency_ms` after they were captured.
Feed with_step(std::size_t cameras, std::size_t broken, std::int64_t step_ms, int latency_ms) {
  Random random(3);
  std::vector<std::pair<double, Shot>> arrivals;
  for (const Shot& shot : regular(cameras, kEnd / 50)) {
    const std::int64_t ms = shot.time_ns / kMs;
    const bool ahead = shot.camera == broken && ms >= kStepAt && ms < kReturnAt;
    arrivals.push_back({static_cast<double>(ms) + random.uniform(0, latency_ms),
                        {shot.camera, shot.time_ns + (ahead ? step_ms * kMs : 0)}});
  }
  std::ranges::stable_sort(arrivals, {}, &std::pair<double, Shot>::first);
  Feed feed(cameras);
  for (const auto& [ms, shot] : arrivals) feed.push({shot});
  return feed;
}

// Number of images of the other cameras in bundles, after the step.
TEST(SynchronizerClock, ThatStepsAheadCostsNoImagesOfOtherCameras) {
  for (const std::size_t cameras : {2u, 3u, 8u}) {
    for (const std::int64_t step_ms : {110, 150, 200, 500, 900, 2'000, 37'000}) {
      for (const auto& [broken, latency_ms] : {std::pair(std::size_t{0}, 0), {cameras - 1, 0}, {cameras - 1, 30}}) {
        SCOPED_TRACE(::testing::Message() << cameras << " cameras, " << broken << " by " << step_ms << " ms, latency "
                                          << latency_ms << " ms");
        const Feed feed = with_step(cameras, broken, step_ms, latency_ms);
        for (const DroppedImage& d : feed.dropped) EXPECT_EQ(d.camera, broken) << d.time_ns / kMs << " ms";
        EXPECT_GT(feed.count(DropReason::kFarAhead), 150u) << "images of a wrong time are not used";
        const auto complete = std::ranges::count_if(feed.bundles, [&](const auto& bundle) {
          return std::ranges::all_of(bundle, [](std::int64_t ms) { return ms >= kReturnAt + 1000; });
        });
        EXPECT_GT(complete, 170) << "the camera is used again when its clock returns";
      }
    }
  }
}

TEST(SynchronizerClock, ThatStepsAheadByLessThanTheWaitCostsAtMostAFrame) {
  for (const std::int64_t step_ms : {10, 25, 50, 80, 100}) {
    const Feed feed = with_step(3, 2, step_ms, 0);
    EXPECT_LE(feed.dropped.size(), 4u) << step_ms;
  }
}

TEST(SynchronizerClock, OfAllCamerasMayStepAhead) {
  for (const std::size_t cameras : {1u, 2u, 8u}) {
    for (const std::int64_t step_ms : {150, 500, 2'000, 37'000}) {
      Feed feed(cameras);
      for (const Shot& shot : regular(cameras, 400))
        feed.push({{shot.camera, shot.time_ns + (shot.time_ns > kStepAt * kMs ? step_ms * kMs : 0)}});
      EXPECT_GE(feed.bundles.size(), 396u) << cameras << " cameras, " << step_ms << " ms";
      EXPECT_LE(feed.dropped.size(), step_ms < 1000 ? 0 : 3 * cameras) << cameras << " cameras, " << step_ms << " ms";
    }
  }
}

// Most cameras agree on the new time: they do not wait for one whose next image comes later.
TEST(SynchronizerClock, OfMostCamerasIsBelieved) {
  Feed feed(4);
  for (const Shot& shot : regular(4, 400)) {
    const std::int64_t ms = shot.time_ns / kMs;
    if (ms > kStepAt && ms < kStepAt + 2'000) continue;
    if (shot.camera < 3 || ms % 500 == 450) feed.push({shot});
  }
  EXPECT_LE(feed.count(DropReason::kFarAhead), 6u);
  EXPECT_LE(feed.dropped.size(), 9u);
}

// The clock of the rig steps while a camera fails: the others need not wait until that is silent.
TEST(SynchronizerClock, OfTheRemainingCamerasMayStepAhead) {
  Feed feed(3);
  for (const Shot& shot : regular(3, 400)) {
    const bool after = shot.time_ns > kStepAt * kMs;
    if (!after || shot.camera != 1) feed.push({{shot.camera, shot.time_ns + (after ? 2'000 * kMs : 0)}});
  }
  EXPECT_GE(feed.bundles.size(), 390u);
}

TEST(SynchronizerClock, IsBelievedAfterAStepWhenTheOtherCameraHasStopped) {
  Feed feed(2);
  for (const Shot& shot : regular(2, 600)) {
    const bool broken = shot.camera == 1 && shot.time_ns >= kStepAt * kMs;
    if (shot.camera == 1 || shot.time_ns < 15'000 * kMs)
      feed.push({{shot.camera, shot.time_ns + (broken ? 37'000 * kMs : 0)}});
  }
  EXPECT_EQ(feed.bundles.back(), (std::vector<std::int64_t>{-1, 66'950}));
}

// A camera whose stamps step although only the delivery of the others has stalled.
TEST(SynchronizerClock, IsUsedAgainAfterOthersWereDelivedLate) {
  std::vector<std::pair<std::int64_t, Shot>> arrivals;
  for (const Shot& shot : regular(3, 400)) {
    const std::int64_t ms = shot.time_ns / kMs;
    const bool stalled = ms > kStepAt && ms < kStepAt + 500;
    if (stalled && shot.camera == 1 && ms % 200 != 0) continue;  // it loses images meanwhile
    arrivals.push_back({ms + (stalled && shot.camera != 1 ? 300 : 10), shot});
  }
  std::ranges::stable_sort(arrivals, {}, &std::pair<std::int64_t, Shot>::first);
  Feed feed(3);
  for (const auto& [ms, shot] : arrivals) feed.push({shot});
  const auto complete =
      std::ranges::count_if(feed.bundles, [](const auto& b) { return std::ranges::min(b) >= kStepAt + 1000; });
  EXPECT_GE(complete, 179);
}

TEST(SynchronizerClock, OfTheFirstImageMayBeFarAhead) {
  constexpr std::int64_t kDay = 86'400'000;
  for (const std::size_t cameras : {2u, 3u}) {
    for (const std::size_t broken : {std::size_t{0}, cameras - 1}) {
      for (const std::int64_t wrong_ms : {kDay, std::int64_t{2'000}}) {
        Feed feed(cameras);
        for (const Shot& shot : regular(cameras, 100)) {
          const bool wrong = shot.camera == broken && shot.time_ns == 0;
          feed.push({{shot.camera, shot.time_ns + (wrong ? wrong_ms * kMs : 0)}});
        }
        EXPECT_EQ(feed.bundles.size(), 100u) << cameras << " cameras, " << broken;
        EXPECT_EQ(feed.count(DropReason::kFarAhead), 1u);
        EXPECT_EQ(feed.dropped.size(), 1u);
      }
    }
  }
}

// A driver may deliver an old image first; the next one of any camera decides.
TEST(SynchronizerClock, MayBeConfirmedByImagesAfterAnOldOne) {
  Feed feed(2);
  feed.push({{0, 5'000 * kMs}, {1, 0}, {0, 5'050 * kMs}, {0, 5'100 * kMs}});
  EXPECT_EQ(feed.close(), (testing::Times{{-1, 0}, {5'000, -1}, {5'050, -1}, {5'100, -1}}));
  EXPECT_TRUE(feed.dropped.empty());
}

// Cameras without a common trigger: their delays drift, and no image is late.
TEST(SynchronizerClock, OfAnotherRateCostsNoImages) {
  for (const double rate : {30.3, 30.1, 29.999, 29.97, 29.9, 29.8, 29.7, 29.0, 14.9}) {
    std::vector<std::pair<double, Shot>> arrivals;
    for (const auto& [camera, hz] : {std::pair(std::size_t{0}, 30.0), {1, rate}, {2, 2 * 30.0 - rate}}) {
      for (int k = 0; k < static_cast<int>(100 * hz); ++k)
        arrivals.push_back(
            {k / hz, {camera, std::llround(k / hz * 1e9) + static_cast<std::int64_t>(3 * camera) * kMs}});
    }
    std::ranges::stable_sort(arrivals, {}, &std::pair<double, Shot>::first);
    Feed feed(3);
    for (const auto& [s, shot] : arrivals) feed.push({shot});
    EXPECT_LE(feed.dropped.size(), 3u) << rate << " Hz";
    EXPECT_TRUE(feed.close().size() > 3000);
  }
}

}  // namespace
}  // namespace bslam
