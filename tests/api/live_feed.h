// Images of live cameras for tests of the Synchronizer.
#pragma once

#include <bslam/synchronizer.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace bslam::testing {

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr int kSide = 16;

inline Rig rig_of(std::size_t cameras) {
  std::vector<CameraCalibration> calibrations(cameras);
  for (std::size_t c = 0; c < cameras; ++c) {
    calibrations[c].name = "cam" + std::to_string(c);
    calibrations[c].model = "pinhole";
    calibrations[c].width = calibrations[c].height = kSide;
    calibrations[c].intrinsics = {10, 10, 8, 8};
  }
  return Rig::make(calibrations).value();
}

struct Shot {
  std::size_t camera = 0;
  std::int64_t time_ns = 0;
};

inline const std::vector<std::uint8_t> g_pixels(kSide* kSide, 7);

inline CameraImage image_at(std::int64_t time_ns) { return {g_pixels.data(), kSide, kSide, kSide, time_ns, nullptr}; }

// Cameras that capture simultaneously every `interval_ms`, in order of time.
inline std::vector<Shot> regular(std::size_t cameras, int count, std::int64_t interval_ms = 50) {
  std::vector<Shot> shots;
  for (int k = 0; k < count; ++k) {
    for (std::size_t c = 0; c < cameras; ++c) shots.push_back({c, k * interval_ms * kMs});
  }
  return shots;
}

using Times = std::vector<std::vector<std::int64_t>>;  // per bundle and camera, ms; -1 if there is no image

inline std::vector<std::int64_t> times_of(const ImageBundle& bundle) {
  std::vector<std::int64_t> out;
  for (const CameraImage& i : bundle.images) out.push_back(i.data == nullptr ? -1 : i.time_ns / kMs);
  return out;
}

class Feed {
 public:
  explicit Feed(std::size_t cameras, SyncOptions options = {})
      : synchronizer(Synchronizer::create(rig_of(cameras), with_log(std::move(options))).value()) {}

  void push(const std::vector<Shot>& shots) {
    for (const Shot& shot : shots) {
      ASSERT_TRUE(synchronizer.push(shot.camera, image_at(shot.time_ns)));
      fetch();
    }
  }
  Times close() {
    EXPECT_TRUE(synchronizer.close());
    fetch();
    return bundles;
  }
  std::size_t count(DropReason reason) const {
    return static_cast<std::size_t>(std::ranges::count(dropped, reason, &DroppedImage::reason));
  }

  Times bundles;
  std::vector<std::vector<std::int64_t>> exact;  // the same in nanoseconds
  std::vector<DroppedImage> dropped;
  Synchronizer synchronizer;

 private:
  SyncOptions with_log(SyncOptions options) {
    options.on_drop = [this](const DroppedImage& d) { dropped.push_back(d); };
    return options;
  }
  void fetch() {
    while (const auto bundle = synchronizer.pop()) {
      bundles.push_back(times_of(*bundle));
      exact.emplace_back();
      for (const CameraImage& i : bundle->images) exact.back().push_back(i.data == nullptr ? -1 : i.time_ns);
    }
  }
};

}  // namespace bslam::testing
