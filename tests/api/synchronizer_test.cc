#include <bslam/synchronizer.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <thread>

#include "api/live_feed.h"
#include "base/random.h"
#include "image/capture_phase.h"
#include "image/frame_grouping.h"

namespace bslam {
namespace {

using testing::Feed;
using testing::g_pixels;
using testing::image_at;
using testing::kMs;
using testing::kSide;
using testing::regular;
using testing::rig_of;
using testing::Shot;
using testing::Times;
using testing::times_of;

// Returns the bundles of the same images grouped as a recording.
Times as_recorded(const std::vector<Shot>& shots, std::size_t cameras) {
  std::vector<std::vector<TimeNs>> times(cameras);
  for (const Shot& shot : shots) times[shot.camera].push_back(shot.time_ns);
  for (auto& t : times) std::ranges::sort(t);
  const image::CapturePhases phases = image::capture_phases(times, 2 * kMs);
  auto in_phase = times;
  for (std::size_t c = 0; c < cameras; ++c) {
    for (TimeNs& t : in_phase[c]) t -= phases.cameras[c].later_ns;
  }
  Times out;
  for (const image::GroupedFrame& frame : image::group_frames(in_phase, phases.tolerance_ns).frames) {
    out.emplace_back();
    for (std::size_t c = 0; c < cameras; ++c) {
      out.back().push_back(frame.images[c] < 0 ? -1 : times[c][static_cast<std::size_t>(frame.images[c])] / kMs);
    }
  }
  return out;
}

TEST(Synchronizer, ReturnsACompleteBundleImmediately) {
  Feed feed(3);
  feed.push(regular(3, 5));
  EXPECT_EQ(feed.bundles.size(), 5u);
  EXPECT_EQ(feed.bundles[4], (std::vector<std::int64_t>{200, 200, 200}));
  EXPECT_TRUE(feed.dropped.empty());
  EXPECT_EQ(feed.synchronizer.counts().waiting, 0u);
}

TEST(Synchronizer, CopiesTheMasksOfImagesWithoutOwner) {
  Feed feed(1);
  CameraImage image = image_at(0);
  const std::ptrdiff_t stride = image.width + 3;
  std::vector<std::uint8_t> mask(static_cast<std::size_t>(stride * image.height), 9);
  for (int y = 0; y < image.height; ++y) std::fill_n(mask.data() + y * stride, image.width, std::uint8_t{1});
  image.mask = mask.data();
  image.mask_stride = stride;
  ASSERT_TRUE(feed.synchronizer.push(0, image));
  std::ranges::fill(mask, std::uint8_t{0});
  ASSERT_TRUE(feed.synchronizer.close());
  const auto bundle = feed.synchronizer.pop();
  ASSERT_TRUE(bundle);
  const CameraImage& copy = bundle->images[0];
  ASSERT_NE(copy.mask, nullptr);
  for (int y = 0; y < copy.height; ++y) {
    for (int x = 0; x < copy.width; ++x) EXPECT_EQ(copy.mask[y * copy.mask_stride + x], 1);
  }
}

TEST(Synchronizer, GroupsShuffledImagesLikeARecording) {
  std::vector<Shot> shots = regular(4, 60);
  const Times expected = as_recorded(shots, 4);
  constexpr std::size_t kBlock = 10;  // number of images, which are within 150 ms
  Random random(5);
  for (std::size_t block = 0; block < shots.size(); block += kBlock) {
    for (std::uint32_t i = kBlock - 1; i > 0; --i) std::swap(shots[block + i], shots[block + random.below(i + 1)]);
  }
  Feed feed(4, {.max_wait_s = 1, .reorder_s = 0.2});
  feed.push(shots);
  EXPECT_EQ(feed.close(), expected);
  EXPECT_TRUE(feed.dropped.empty());
}

TEST(Synchronizer, LeavesLostImagesEmpty) {
  std::vector<Shot> shots = regular(3, 80), kept;
  Random random(6);
  for (const Shot& shot : shots) {
    if (shot.time_ns < 500 * kMs || random.below(10) > 0) kept.push_back(shot);
  }
  ASSERT_LT(kept.size(), shots.size());
  Feed feed(3);
  feed.push(kept);
  EXPECT_EQ(feed.close(), as_recorded(kept, 3));
  EXPECT_TRUE(feed.dropped.empty());
}

// Returns the number of images of `shots` that are neither in exactly one bundle nor dropped exactly once.
std::size_t lost_or_repeated(const std::vector<Shot>& shots, const Feed& feed) {
  std::map<std::pair<std::size_t, std::int64_t>, int> uses;
  for (const std::vector<std::int64_t>& bundle : feed.exact) {
    for (std::size_t c = 0; c < bundle.size(); ++c) {
      if (bundle[c] >= 0) ++uses[{c, bundle[c]}];
    }
  }
  for (const DroppedImage& d : feed.dropped) ++uses[{d.camera, d.time_ns}];
  return static_cast<std::size_t>(std::ranges::count_if(shots, [&](const Shot& s) {
    return uses[{s.camera, s.time_ns}] != 1;
  }));
}

TEST(Synchronizer, AnImageOfCamera0AfterABundleDoesNotUseItsImagesAgain) {
  for (const double delay_ms : {0.3, 0.8, 1.5, 1.9}) {
    for (const double extra_ms : {1.0, 2.0, 3.0, 3.7, 5.0}) {
      std::vector<Shot> shots;
      for (std::int64_t k = 20; k < 40; ++k) {
        shots.push_back({0, k * 50 * kMs});
        shots.push_back({1, k * 50 * kMs + static_cast<std::int64_t>(delay_ms * kMs)});
        if (k == 30) shots.push_back({0, k * 50 * kMs + static_cast<std::int64_t>(extra_ms * kMs)});
      }
      Feed feed(2);
      feed.push(shots);
      feed.close();
      EXPECT_EQ(lost_or_repeated(shots, feed), 0u) << delay_ms << " ms, " << extra_ms << " ms";
      EXPECT_GE(feed.bundles.size(), 20u);
    }
  }
}

TEST(Synchronizer, DoesNotWaitForASilentCamera) {
  for (const std::size_t dead : {0u, 2u}) {
    std::vector<Shot> shots;
    for (const Shot& shot : regular(3, 100)) {
      if (shot.camera != dead || shot.time_ns < 1000 * kMs) shots.push_back(shot);
    }
    Feed feed(3);
    feed.push(shots);
    EXPECT_EQ(feed.bundles.size(), 100u);
    EXPECT_EQ(feed.close(), as_recorded(shots, 3));
    EXPECT_TRUE(feed.dropped.empty());
  }
}

TEST(Synchronizer, WaitsForASilentCameraUpToTheMaximum) {
  Feed feed(2, {.max_wait_s = 0.12, .silent_after_s = 10});
  std::vector<Shot> shots;
  for (const Shot& shot : regular(2, 20)) {
    if (shot.camera == 0 || shot.time_ns < 500 * kMs) shots.push_back(shot);
  }
  feed.push(shots);
  EXPECT_EQ(feed.bundles.size(), 17u);  // up to 800 ms: the last image is at 950 ms, and the maximum delay is 120 ms
  EXPECT_EQ(feed.synchronizer.counts().waiting, 3u);
}

TEST(Synchronizer, AcceptsCamerasOfDifferentRates) {
  std::vector<Shot> shots;
  for (int k = 0; k < 60; ++k) {
    shots.push_back({0, k * 30 * kMs});
    if (k % 3 == 0) shots.push_back({1, k * 30 * kMs});
  }
  Feed feed(2);
  feed.push(shots);
  EXPECT_EQ(feed.close(), as_recorded(shots, 2));
  EXPECT_TRUE(feed.dropped.empty());
}

TEST(Synchronizer, GroupsRandomLossesLikeARecording) {
  std::vector<Shot> kept;
  Random random(7);
  for (const Shot& shot : regular(3, 200)) {
    if (shot.time_ns < 500 * kMs || random.below(2) > 0) kept.push_back(shot);
  }
  Feed feed(3, {.max_wait_s = 10, .silent_after_s = 10, .max_images = 1000, .max_bundles = 1000});
  feed.push(kept);
  EXPECT_EQ(feed.close(), as_recorded(kept, 3));
  EXPECT_TRUE(feed.dropped.empty());
}

// Returns the bundles whose first image was captured at `ms` or later.
Times from(const Times& bundles, std::int64_t ms) {
  Times out;
  std::ranges::copy_if(bundles, std::back_inserter(out), [ms](const std::vector<std::int64_t>& bundle) {
    return std::ranges::all_of(bundle, [ms](std::int64_t t) { return t < 0 || t >= ms; });
  });
  return out;
}

TEST(Synchronizer, GroupsCamerasAtOtherTimesLikeARecording) {
  std::vector<Shot> shots;
  for (int k = 0; k < 60; ++k) {
    shots.push_back({0, k * 50 * kMs});
    shots.push_back({1, (k * 50 + 20) * kMs});
    shots.push_back({2, k * 33 * kMs});
    shots.push_back({3, (k * 50 + 35) * kMs});
  }
  std::ranges::stable_sort(shots, {}, &Shot::time_ns);
  Feed feed(4, {.max_bundles = 1000});
  feed.push(shots);
  const Times bundles = feed.close(), expected = as_recorded(shots, 4);
  EXPECT_EQ(from(bundles, 400), from(expected, 400));  // until then, images have shown the phases of the cameras
  EXPECT_EQ(bundles.front(), (std::vector<std::int64_t>{0, -1, 0, -1}));
  const auto together =
      std::ranges::count_if(bundles, [](const auto& b) { return b[0] >= 0 && b[1] == b[0] + 20 && b[3] == b[0] - 15; });
  EXPECT_GE(together, 50);
  EXPECT_TRUE(feed.dropped.empty());
}

// Times that vary by up to 3 ms, of cameras of equal or different rates.
TEST(Synchronizer, GroupsImpreciseTimes) {
  for (const std::int64_t interval_ms : {50, 100}) {
    Random random(9);
    std::vector<Shot> shots;
    for (std::int64_t ms = 0; ms < 10'000; ms += 50) {
      if (ms < 4000 || ms > 4600) shots.push_back({0, ms * kMs});  // a gap
      if (ms % interval_ms == 0) shots.push_back({1, ms * kMs + random.below(6001) * (kMs / 1000) - 3 * kMs});
    }
    std::ranges::stable_sort(shots, {}, &Shot::time_ns);
    Feed feed(2, {.max_bundles = 1000});
    feed.push(shots);
    for (const auto& bundle : feed.close()) {
      const bool start = std::ranges::max(bundle) < 700;
      const bool gap = bundle[1] > 3980 && bundle[1] < 4620;
      EXPECT_TRUE(start || gap || bundle[0] >= 0) << bundle[1] << " ms";
    }
  }
}

TEST(Synchronizer, FollowsACameraWhosePhaseChanges) {
  std::vector<Shot> shots;
  for (int k = 0; k < 120; ++k) {
    shots.push_back({0, k * 50 * kMs});
    shots.push_back({1, (k * 50 + (k < 40 ? 25 : k < 80 ? -15 : 0)) * kMs});
  }
  std::ranges::stable_sort(shots, {}, &Shot::time_ns);
  Feed feed(2);
  feed.push(shots);
  const Times bundles = feed.close();
  for (const std::int64_t k : {30, 70, 110}) {
    const std::int64_t phase = k < 40 ? 25 : k < 80 ? -15 : 0;
    EXPECT_TRUE(std::ranges::count(bundles, std::vector<std::int64_t>{50 * k, 50 * k + phase})) << k;
  }
  EXPECT_LE(feed.dropped.size(), 1u);  // the image at 4000 ms would be a bundle of the same time as the last one
}

// Random rates, phases, jitter, losses and delays: what every sequence of bundles has, and what System::process needs.
TEST(Synchronizer, EveryImageIsInOneBundleInOrderOfTimeOrDropped) {
  Random random(8);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<std::pair<std::int64_t, Shot>> arrivals;
    for (std::size_t c = 0; c < 3; ++c) {
      std::int64_t period = random.below(3) == 0 ? 33 : 50, phase = random.below(50);
      for (int k = 0; k < 80; ++k) {
        if (random.below(40) == 0) phase = random.below(50);  // as after a restart of the camera
        if (random.below(8) == 0) continue;
        const std::int64_t ms = 100 * static_cast<std::int64_t>(c) + k * period + phase + random.below(3);
        arrivals.push_back({ms + random.below(trial % 2 == 0 ? 1 : 120), {c, ms * kMs}});
      }
    }
    std::ranges::stable_sort(arrivals, {}, [](const auto& arrival) { return arrival.first; });
    Feed feed(3, {.reorder_s = trial % 2 == 0 ? 0.0 : 0.1});
    for (const auto& [ms, shot] : arrivals) feed.push({shot});
    std::vector<std::int64_t> last(4, -1);
    std::size_t images = 0;
    for (const auto& bundle : feed.close()) {
      std::int64_t time = bundle[0];
      for (std::size_t c = 0; c < 3; ++c) {
        if (bundle[c] < 0) continue;
        EXPECT_GT(bundle[c], last[c]) << "camera " << c << ", trial " << trial;
        last[c] = bundle[c];
        if (bundle[0] < 0 && (time < 0 || bundle[c] < time)) time = bundle[c];
        ++images;
      }
      EXPECT_GT(time, last[3]) << "trial " << trial;
      last[3] = time;
    }
    EXPECT_EQ(images + feed.dropped.size(), arrivals.size());
    ASSERT_FALSE(HasFailure());
  }
}

TEST(Synchronizer, ReportsDroppedImagesAndReasons) {
  Feed feed(2);
  feed.push(regular(2, 10));
  feed.push({{1, 450 * kMs}});  // duplicate
  feed.push({{0, 430 * kMs}});  // too late
  feed.push({{0, 500 * kMs}, {1, 460 * kMs}, {1, 500 * kMs}});
  feed.push({{1, 1'600 * kMs}});  // a broken clock
  feed.push({{0, 550 * kMs}, {1, 550 * kMs}});
  EXPECT_EQ(feed.close().size(), 13u);  // the image at 460 ms is a bundle
  EXPECT_EQ(feed.dropped.size(), 3u);
  EXPECT_EQ(feed.count(DropReason::kDuplicate), 1u);
  EXPECT_EQ(feed.count(DropReason::kTooLate), 1u);
  EXPECT_EQ(feed.count(DropReason::kFarAhead), 1u);
  EXPECT_EQ(feed.synchronizer.counts().dropped[1][static_cast<std::size_t>(DropReason::kFarAhead)], 1u);
}

TEST(Synchronizer, AcceptsAClockThatStaysAhead) {
  Feed feed(1);
  feed.push(regular(1, 5));
  for (int k = 0; k < 6; ++k) feed.push({{0, (100'000 + 50 * k) * kMs}});
  EXPECT_EQ(feed.bundles.size(), 9u);
  EXPECT_EQ(feed.count(DropReason::kFarAhead), 2u);
}

// Their images are farther apart than the bound for other cameras.
TEST(Synchronizer, AcceptsSlowCameras) {
  Feed feed(2);
  feed.push(regular(2, 20, 3000));
  EXPECT_GE(feed.close().size(), 17u);
  EXPECT_LE(feed.count(DropReason::kFarAhead), 4u);  // until the rate is known
}

// A camera is not silent as long as its next image is not due, however slow it is.
TEST(Synchronizer, WaitsForSlowCameras) {
  constexpr int kCount = 30;
  for (const std::int64_t interval_ms : {1000, 1001, 2000, 5000}) {
    Random random(10);
    std::vector<Shot> shots = regular(2, kCount, interval_ms);
    for (Shot& shot : shots) shot.time_ns += random.below(200'001);  // jitter of 0.2 ms
    Feed feed(2);
    feed.push(shots);
    const Times bundles = feed.close();
    const auto complete = std::ranges::count_if(bundles, [](const auto& b) { return b[0] >= 0 && b[1] >= 0; });
    EXPECT_GE(complete, kCount - 4) << interval_ms << " ms";  // until the rate is known
  }
}

TEST(Synchronizer, WaitsForASlowCameraBesideAFastOne) {
  std::vector<Shot> shots;
  for (int k = 0; k < 400; ++k) {
    shots.push_back({0, k * 50 * kMs});
    if (k % 40 == 0) shots.push_back({1, k * 50 * kMs + kMs});
  }
  Feed feed(2);
  feed.push(shots);
  EXPECT_EQ(feed.close().size(), 400u);
  const auto complete = std::ranges::count_if(feed.bundles, [](const auto& b) { return b[0] >= 0 && b[1] >= 0; });
  EXPECT_GE(complete, 8) << "until the rate is known";
  EXPECT_LE(feed.dropped.size(), 2u);
}

// Whether a thread of this process sleeps in the kernel.
bool asleep(long thread) {
  std::ifstream file("/proc/self/task/" + std::to_string(thread) + "/stat");
  std::string number, name;
  char state = 0;
  file >> number >> name >> state;
  return state == 'S';
}

TEST(Synchronizer, ItsEndEndsCallsOfWait) {
  for (int k = 0; k < 20; ++k) {
    auto synchronizer = std::make_unique<Synchronizer>(Synchronizer::create(rig_of(1)).value());
    std::array<std::atomic<long>, 2> ids = {};
    std::vector<std::jthread> threads;
    for (std::atomic<long>& id : ids) {
      threads.emplace_back([&id, &waited = *synchronizer] {
        id = ::syscall(SYS_gettid);
        EXPECT_FALSE(waited.wait());
      });
    }
    for (const std::atomic<long>& id : ids) {
      while (id == 0 || !asleep(id)) std::this_thread::yield();
    }
    synchronizer.reset();
  }
}

TEST(Synchronizer, WaitsForALimitedTimeIfAskedTo) {
  auto synchronizer = Synchronizer::create(rig_of(1)).value();
  for (const double none : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), 0.02})
    EXPECT_FALSE(synchronizer.wait_for(none)) << none;
  std::jthread camera([&] { EXPECT_TRUE(synchronizer.push(0, image_at(50 * kMs))); });
  EXPECT_EQ(times_of(*synchronizer.wait_for(std::numeric_limits<double>::infinity())), std::vector<std::int64_t>{50});
  camera.join();
  EXPECT_TRUE(synchronizer.close());
  EXPECT_FALSE(synchronizer.wait_for(1e9));
}

TEST(Synchronizer, HoldsABoundedNumberOfImagesAndBundles) {
  const auto drops = std::make_shared<std::size_t>(0);
  SyncOptions options{.max_wait_s = 1000, .silent_after_s = 1000, .max_images = 5, .max_bundles = 3};
  options.on_drop = [drops](const DroppedImage& d) { *drops += d.reason == DropReason::kOverflow; };
  auto synchronizer = Synchronizer::create(rig_of(2), options).value();
  for (int k = 0; k < 20; ++k) ASSERT_TRUE(synchronizer.push(0, image_at(k * 50 * kMs)));
  EXPECT_EQ(synchronizer.counts().waiting, 5u);
  EXPECT_EQ(synchronizer.counts().bundles, 3u);
  EXPECT_EQ(*drops, 12u);
  EXPECT_EQ(times_of(*synchronizer.pop()), (std::vector<std::int64_t>{600, -1}));
}

TEST(Synchronizer, ReportsAllDropsAndReturnsTheFirstException) {
  std::vector<std::int64_t> reported;
  SyncOptions options{.tolerance_s = 0.002, .max_wait_s = 1000, .silent_after_s = 1000, .max_bundles = 1};
  options.on_drop = [&reported](const DroppedImage& d) {
    reported.push_back(d.time_ns / kMs);
    throw std::runtime_error("drop " + std::to_string(reported.size()));
  };
  auto synchronizer = Synchronizer::create(rig_of(2), options).value();
  for (const std::int64_t ms : {0, 50, 100}) ASSERT_TRUE(synchronizer.push(0, image_at(ms * kMs)));
  const Status pushed = synchronizer.push(1, image_at(150 * kMs));  // completes three bundles
  ASSERT_FALSE(pushed);
  EXPECT_NE(pushed.error().message().find("drop 1"), std::string::npos);
  EXPECT_EQ(reported, (std::vector<std::int64_t>{0, 50}));
  EXPECT_TRUE(synchronizer.close());
  std::size_t bundles = 0;
  while (synchronizer.wait()) ++bundles;
  EXPECT_EQ(bundles, 2u);
  EXPECT_TRUE(synchronizer.close());
}

TEST(Synchronizer, CopiesPixelsWithoutOwner) {
  auto synchronizer = Synchronizer::create(rig_of(1)).value();
  std::vector<std::uint8_t> pixels(2 * kSide * kSide, 1);
  for (int y = 0; y < kSide; ++y) pixels[static_cast<std::size_t>(2 * kSide * y + 3)] = static_cast<std::uint8_t>(y);
  ASSERT_TRUE(synchronizer.push(0, {pixels.data(), kSide, kSide, 2 * kSide, 0, nullptr}));
  std::ranges::fill(pixels, std::uint8_t{0});
  const ImageBundle bundle = synchronizer.pop().value();
  const CameraImage& image = bundle.images[0];
  for (int y = 0; y < kSide; ++y) {
    EXPECT_EQ(image.data[y * image.stride + 3], y);
    EXPECT_EQ(image.data[y * image.stride + 4], 1);
  }
}

TEST(Synchronizer, AddsTheTimeOffsetsOfTheRig) {
  CameraCalibration late = rig_of(2).camera(1);
  late.time_offset_s = 0.03;
  auto synchronizer = Synchronizer::create(Rig::make({rig_of(1).camera(0), late}).value()).value();
  ASSERT_TRUE(synchronizer.push(0, image_at(100 * kMs)));
  ASSERT_TRUE(synchronizer.push(1, image_at(70 * kMs)));
  EXPECT_EQ(times_of(synchronizer.pop().value()), (std::vector<std::int64_t>{100, 70}));
}

TEST(Synchronizer, RejectsInvalidImagesAndOptions) {
  auto synchronizer = Synchronizer::create(rig_of(1)).value();
  EXPECT_FALSE(synchronizer.push(1, image_at(0)));
  EXPECT_FALSE(synchronizer.push(0, {}));
  EXPECT_FALSE(synchronizer.push(0, {g_pixels.data(), 8, kSide, kSide, 0, nullptr}));
  EXPECT_FALSE(synchronizer.push(0, {g_pixels.data(), kSide, kSide, kSide - 1, 0, nullptr}));
  EXPECT_FALSE(synchronizer.push(0, image_at(std::numeric_limits<std::int64_t>::max())));
  EXPECT_TRUE(synchronizer.close());
  EXPECT_FALSE(synchronizer.push(0, image_at(0)));
  EXPECT_FALSE(synchronizer.wait());
  EXPECT_FALSE(Synchronizer::create(rig_of(1), {.tolerance_s = -1}));
  EXPECT_FALSE(Synchronizer::create(rig_of(1), {.max_wait_s = std::numeric_limits<double>::quiet_NaN()}));
  EXPECT_FALSE(Synchronizer::create(rig_of(1), {.max_bundles = 0}));
}

TEST(Synchronizer, AcceptsImagesFromOneThreadPerCamera) {
  constexpr int kCount = 200;
  auto synchronizer = Synchronizer::create(rig_of(3), {.max_wait_s = 1000,
                                                       .silent_after_s = 1000,
                                                       .max_ahead_s = 1000,
                                                       .max_images = kCount,
                                                       .max_bundles = kCount})
                          .value();
  std::vector<std::thread> cameras;
  for (std::size_t c = 0; c < 3; ++c) {
    cameras.emplace_back([&synchronizer, c] {
      for (int k = 0; k < kCount; ++k) EXPECT_TRUE(synchronizer.push(c, image_at(k * 50 * kMs)));
    });
  }
  std::thread end([&] {
    for (std::thread& camera : cameras) camera.join();
    EXPECT_TRUE(synchronizer.close());
  });
  int bundles = 0;
  while (const auto bundle = synchronizer.wait()) {
    EXPECT_EQ(times_of(*bundle), (std::vector<std::int64_t>(3, 50 * bundles)));
    ++bundles;
  }
  end.join();
  EXPECT_EQ(bundles, kCount);
}

}  // namespace
}  // namespace bslam
