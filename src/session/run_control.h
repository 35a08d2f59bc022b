// Decides when the frames of a run are fed: as fast as possible or at a multiple of their recorded pace, with pauses
// and single steps. It never changes which frames are processed, except at a recorded pace with Late::kDrop.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <stop_token>

#include "base/timestamp.h"

namespace bslam::session {

// All functions are thread-safe.
class RunControl {
 public:
  // `speed`: multiple of the recorded pace; 0: as fast as possible.
  explicit RunControl(double speed = 0) : speed_(speed) {}

  void pause();
  void resume();
  void step();  // pauses, and lets one frame pass
  // Accepts 0 and kMinSpeed to kMaxSpeed; other values are ignored.
  void set_speed(double speed);
  static constexpr double kMinSpeed = 0.01, kMaxSpeed = 1000;

  struct State {
    bool paused = false;
    double speed = 0;
    friend bool operator==(const State&, const State&) = default;
  };
  State state() const;

  // Waits until the next frame, which was captured at `time_ns`, is to be fed, and returns true; or until a stop is
  // requested, and returns false. Frames are due relative to the first one, or to the last one before the pace changed,
  // or to the first one after a pause or a jump of the clock (dataset::kLongPause), which is not waited for.
  bool wait_for(TimeNs time_ns, const std::stop_token& stop);

  // How late a frame captured at `time_ns` is, in seconds of the recorded pace; 0 if it is not late, while paused, and
  // if frames are fed as fast as possible.
  double lateness_s(TimeNs time_ns) const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Anchor {
    TimeNs time_ns;
    Clock::time_point due;
  };
  std::optional<Clock::time_point> due(TimeNs time_ns) const;  // nullopt: at once; mutex_ must be held

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  // Guarded by mutex_.
  bool paused_ = false;
  int steps_ = 0;  // frames that may pass while paused
  double speed_;
  std::optional<TimeNs> last_ns_;  // time of the last frame
  std::optional<Anchor> anchor_;   // nullopt: the next frame is due at once, and becomes the anchor
};

}  // namespace bslam::session
