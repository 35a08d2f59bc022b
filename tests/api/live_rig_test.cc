// Live cameras as on a robot: a thread per camera with random delays, losses and restarts, a Synchronizer, and a System
// that runs meanwhile. The camera threads follow a clock that the test advances, so that nothing sleeps. By default two
// sessions are run; BSLAM_LIVE_SECONDS=600 repeats longer ones for ten minutes and prints the memory.
#include <bslam/bslam.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "api/textured_wall.h"
#include "base/random.h"

namespace bslam {
namespace {

using testing::TexturedWall;

constexpr std::size_t kCameras = 3;
constexpr int kTurn = 120;                                      // frames until the rig moves back
constexpr std::int64_t kLate = TexturedWall::kInterval_ns / 2;  // ns by which camera 2 captures later than the others
constexpr double kMetresPerFrame = TexturedWall::kStep * TexturedWall::kMetresPerPixel;  // of camera 0

// Times are in frames: camera 2 captures at half frames.
double position(double frame) {
  const double t = std::fmod(frame, 2 * kTurn);
  return t < kTurn ? t : 2 * kTurn - t;
}

Rig live_rig() {
  std::vector<CameraCalibration> cameras;
  for (int c = 0; c < static_cast<int>(kCameras); ++c) {
    cameras.push_back(TexturedWall::calibration(c));
    cameras.back().name = "cam" + std::to_string(c);
  }
  return Rig::make(cameras).value();
}

CameraImage captured(const TexturedWall& wall, std::size_t camera, int k) {
  CameraImage image = wall.image(0, static_cast<int>(camera));
  const bool late = camera == 2;
  image.data += static_cast<std::ptrdiff_t>(TexturedWall::kStep * position(late ? k + 0.5 : k));
  image.time_ns += k * TexturedWall::kInterval_ns + (late ? kLate : 0);
  return image;
}

bool same_pixels(const CameraImage& a, const CameraImage& b) {
  for (int y = 0; y < a.height; ++y) {
    if (std::memcmp(a.data + y * a.stride, b.data + y * b.stride, static_cast<std::size_t>(a.width)) != 0) return false;
  }
  return true;
}

double resident_mb() {
  std::ifstream statm("/proc/self/statm");
  double total = 0, resident = 0;
  statm >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

// One run of cameras, Synchronizer and System.
class Session {
 public:
  Session(int frames, std::uint64_t seed) : frames_(frames), seed_(seed), random_(seed) {
    SyncOptions options{.reorder_s = 0.1};
    options.on_drop = [this](const DroppedImage&) { ++reported_; };
    synchronizer_.emplace(Synchronizer::create(live_rig(), options).value());
    Config config;
    EXPECT_TRUE(config.set("features.per_image", "300"));
    system_.emplace(System::create(live_rig(), config, {.history_frames = 50}).value());
  }

  void run() {
    std::thread clock([this] { advance(); });
    while (const auto bundle = synchronizer_->wait()) process(*bundle);
    clock.join();
    EXPECT_TRUE(system_->finish());
    check_counts();
    EXPECT_GT(tracked_, bundles_ / 2) << bundles_ << " bundles";
    system_.reset();
    synchronizer_.reset();
    EXPECT_EQ(owners_, 0) << "images that are still held";
  }

 private:
  struct LiveCamera {
    std::thread thread;
    std::atomic<bool> off{false};
    int on_at = 0;  // frame at which it is started
    int done = 0;   // frame up to which it has captured; guarded by the mutex
  };

  // The thread of a camera: takes an image of every frame and delivers it up to two frames later, or never.
  void capture(std::size_t camera, int first) {
    Random random(seed_ + 100 * static_cast<std::uint64_t>(first) + camera);
    std::vector<std::pair<int, int>> delayed;  // frame of delivery, frame of capture
    for (int k = first; wait_for(k, cameras_[camera]); ++k) {
      if (random.below(15) > 0) delayed.emplace_back(k + static_cast<int>(random.below(3)), k);
      std::erase_if(delayed, [&](const auto& d) { return d.first <= k && (push(camera, d.second, random), true); });
      const std::lock_guard lock(mutex_);
      cameras_[camera].done = k;
      changed_.notify_all();
    }
  }

  void push(std::size_t camera, int k, Random& random) {
    CameraImage image = captured(wall_, camera, k);
    std::vector<std::uint8_t> copy;
    if (random.below(2) == 0) {  // shares its pixels
      ++owners_;
      image.owner = std::shared_ptr<const void>(image.data, [this](const void*) { --owners_; });
    } else {  // lends them for the call
      for (int y = 0; y < image.height; ++y) {
        copy.insert(copy.end(), image.data + y * image.stride, image.data + y * image.stride + image.width);
      }
      image.data = copy.data();
      image.stride = image.width;
    }
    if (synchronizer_->push(camera, image)) ++pushed_;  // an error after it was closed
    std::ranges::fill(copy, std::uint8_t{0});
  }

  bool wait_for(int k, const LiveCamera& camera) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return camera.off || now_ >= k; });
    return !camera.off;
  }

  // The thread of the clock: begins the frames, a random number ahead of the cameras and of the System, and restarts
  // cameras.
  void advance() {
    for (int k = 0; k < frames_; ++k) {
      const int behind = static_cast<int>(random_.below(4));
      const std::size_t waiting = 1 + random_.below(6);  // at times more than SyncOptions::max_bundles
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] {
          const bool captured = std::ranges::all_of(cameras_, [&](const LiveCamera& camera) {
            return !camera.thread.joinable() || camera.done >= k - 1 - behind;
          });
          return captured && synchronizer_->counts().bundles - bundles_ < waiting;
        });
        now_ = k;
      }
      changed_.notify_all();
      restart_cameras(k);
    }
    if (seed_ % 2 == 0) close();  // while the cameras are still delivering
    for (LiveCamera& camera : cameras_) stop(camera);
    close();
  }

  void close() { EXPECT_TRUE(synchronizer_->close()); }

  void restart_cameras(int k) {
    bool all_run = true;
    for (std::size_t c = 0; c < kCameras; ++c) {
      LiveCamera& camera = cameras_[c];
      if (!camera.thread.joinable() && k >= camera.on_at) {
        camera.off = false;
        camera.done = k - 1;
        camera.thread = std::thread([this, c, k] { capture(c, k); });
      }
      all_run &= camera.thread.joinable();
    }
    if (!all_run || random_.below(25) > 0) return;
    LiveCamera& camera = cameras_[random_.below(kCameras)];
    stop(camera);
    camera.on_at = k + 1 + static_cast<int>(random_.below(30));  // up to more than SyncOptions::silent_after_s
  }

  void stop(LiveCamera& camera) {
    {
      const std::lock_guard lock(mutex_);
      camera.off = true;
    }
    changed_.notify_all();
    if (camera.thread.joinable()) camera.thread.join();
  }

  void process(const ImageBundle& bundle) {
    int frame = -1;
    for (std::size_t c = 0; c < kCameras; ++c) {
      const CameraImage& image = bundle.images[c];
      if (image.data == nullptr) continue;
      const std::int64_t since = image.time_ns - TexturedWall::kStart_ns - (c == 2 ? kLate : 0);
      const int k = static_cast<int>(since / TexturedWall::kInterval_ns);
      if (frame < 0) frame = k;
      EXPECT_EQ(k, frame) << "camera " << c << " has an image of another frame";
      EXPECT_TRUE(same_pixels(image, captured(wall_, c, k))) << "camera " << c << ", frame " << k;
      ++in_bundles_;
    }
    const auto result = system_->process(bundle);
    ASSERT_TRUE(result) << result.error().message();
    if (result->tracking()) check_pose(*result);
    {
      const std::lock_guard lock(mutex_);
      ++bundles_;
    }
    changed_.notify_all();
  }

  // The images of the next frame would move the rig by 4 cm.
  void check_pose(const FrameResult& result) {
    ++tracked_;
    const double frame = static_cast<double>(result.time_ns - TexturedWall::kStart_ns) / TexturedWall::kInterval_ns;
    const double from_start = result.T_world_cam0.translation[0] - kMetresPerFrame * position(frame);
    const double start = start_.try_emplace(result.submap, from_start).first->second;
    EXPECT_NEAR(from_start, start, 0.03) << "frame " << frame << ", submap " << result.submap;
  }

  void check_counts() {
    const SyncCounts counts = synchronizer_->counts();
    std::size_t pushed = 0, dropped = 0;
    for (std::size_t c = 0; c < kCameras; ++c) {
      pushed += counts.pushed[c];
      for (const std::size_t n : counts.dropped[c]) dropped += n;
    }
    EXPECT_EQ(counts.waiting, 0u);
    EXPECT_EQ(counts.bundles, bundles_);
    EXPECT_EQ(pushed, pushed_);
    EXPECT_EQ(dropped, reported_);
    EXPECT_EQ(pushed, in_bundles_ + dropped);
  }

  const int frames_;
  const std::uint64_t seed_;
  Random random_;  // of the clock
  const TexturedWall wall_;
  std::optional<Synchronizer> synchronizer_;
  std::optional<System> system_;
  std::array<LiveCamera, kCameras> cameras_;
  std::mutex mutex_;
  std::condition_variable changed_;
  int now_ = -1;             // frame; guarded by the mutex, like the next member
  std::size_t bundles_ = 0;  // that the System has processed
  std::atomic<int> owners_ = 0;
  std::atomic<std::size_t> pushed_ = 0, reported_ = 0;
  std::size_t in_bundles_ = 0, tracked_ = 0;
  std::map<int, double> start_;  // per submap: position of its world frame
};

TEST(LiveRig, KeepsFramesTogetherWithDelaysLossesAndRestarts) {
  const char* const seconds = std::getenv("BSLAM_LIVE_SECONDS");
  const std::chrono::seconds duration(seconds == nullptr ? 0 : std::atoi(seconds));
  const auto begin = std::chrono::steady_clock::now();
  const auto passed = [begin] { return std::chrono::steady_clock::now() - begin; };
  double half_mb = 0;  // memory after half of the time: until then, arenas of threads grow
  std::uint64_t session = 0;
  while (session < 2 || passed() < duration) {
    Session(seconds == nullptr ? 80 : 400, ++session).run();
    ASSERT_FALSE(HasFailure()) << "session " << session;
    if (session == 1 && seconds != nullptr) std::cout << "memory after a session: " << resident_mb() << " MB\n";
    if (half_mb == 0 && 2 * passed() >= duration) half_mb = resident_mb();
  }
  if (seconds == nullptr) return;
  std::cout << "after half of the time: " << half_mb << " MB; at the end, after " << session
            << " sessions: " << resident_mb() << " MB\n";
  EXPECT_LT(resident_mb(), 1.1 * half_mb);
}

}  // namespace
}  // namespace bslam
