#include "session/run_control.h"

#include <algorithm>
#include <cmath>

#include "dataset/long_pause.h"

namespace bslam::session {

void RunControl::pause() {
  const std::lock_guard lock(mutex_);
  paused_ = true;
  steps_ = 0;
  changed_.notify_all();
}

void RunControl::resume() {
  const std::lock_guard lock(mutex_);
  paused_ = false;
  steps_ = 0;
  anchor_.reset();
  changed_.notify_all();
}

void RunControl::step() {
  constexpr int kMaxSteps = 1000;
  const std::lock_guard lock(mutex_);
  paused_ = true;
  steps_ = std::min(steps_ + 1, kMaxSteps);
  changed_.notify_all();
}

void RunControl::set_speed(double speed) {
  if (speed != 0 && !(speed >= kMinSpeed && speed <= kMaxSpeed)) return;
  const std::lock_guard lock(mutex_);
  speed_ = speed;
  anchor_.reset();
  changed_.notify_all();
}

RunControl::State RunControl::state() const {
  const std::lock_guard lock(mutex_);
  return {paused_, speed_};
}

std::optional<RunControl::Clock::time_point> RunControl::due(TimeNs time_ns) const {
  constexpr double kMost_ns = 1e18;  // further than any wait; sums with it fit
  if (speed_ == 0 || !anchor_) return std::nullopt;
  const double after_ns = (static_cast<double>(time_ns) - static_cast<double>(anchor_->time_ns)) / speed_;
  return anchor_->due + std::chrono::nanoseconds(std::llround(std::clamp(after_ns, -kMost_ns, kMost_ns)));
}

bool RunControl::wait_for(TimeNs time_ns, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  if (last_ns_ && (time_ns < *last_ns_ || time_ns - *last_ns_ > dataset::kLongPause)) anchor_.reset();
  last_ns_ = time_ns;
  for (;;) {
    if (paused_) {
      if (!changed_.wait(lock, stop, [this] { return !paused_ || steps_ > 0; })) return false;
      if (!paused_) continue;
      --steps_;
      anchor_.reset();
      return true;
    }
    if (stop.stop_requested()) return false;
    const auto until = due(time_ns);
    if (!until || *until <= Clock::now()) break;
    const State before{paused_, speed_};
    changed_.wait_until(lock, stop, *until, [&] { return !(State{paused_, speed_} == before) || !anchor_; });
  }
  if (!anchor_) anchor_ = Anchor{time_ns, Clock::now()};
  return true;
}

double RunControl::lateness_s(TimeNs time_ns) const {
  const std::lock_guard lock(mutex_);
  const auto at = due(time_ns);
  if (paused_ || !at) return 0;
  return std::max(0.0, speed_ * std::chrono::duration<double>(Clock::now() - *at).count());
}

}  // namespace bslam::session
