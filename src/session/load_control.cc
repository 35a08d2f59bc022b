#include "session/load_control.h"

#include <algorithm>

namespace bslam::session {
namespace {

// Number of frames behind and delay above both of which the level is raised. At high rates, a few frames are no delay.
constexpr double kLate = 1.0, kLate_s = 0.05;
// Number of frames behind and delay up to either of which a frame is in time.
constexpr double kInTime = 0.2, kInTime_s = 0.01;
constexpr double kEffective_s = 0.2;  // time until a change takes effect

}  // namespace

int LoadControl::update(double behind, double late_s, TimeNs time_ns) {
  if (behind > kInTime && late_s > kInTime_s) calm_since_ns_ = time_ns;
  const bool late = behind > kLate && late_s > kLate_s, still_late = late && was_late_;
  was_late_ = late;
  if (still_late && level_ < kMaxReduction && (level_ == 0 || to_seconds(time_ns - raised_ns_) > kEffective_s)) {
    // The level was lowered too early: next time it takes longer.
    if (lowered_ns_ > 0 && to_seconds(time_ns - lowered_ns_) < patience_s_)
      patience_s_ = std::min(2 * patience_s_, kMaxPatience_s);
    ++level_;
    raised_ns_ = time_ns;
  } else if (level_ > 0 && to_seconds(time_ns - calm_since_ns_) > patience_s_) {
    --level_;
    lowered_ns_ = calm_since_ns_ = time_ns;
  }
  return level_;
}

}  // namespace bslam::session
