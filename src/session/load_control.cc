#include "session/load_control.h"

#include <algorithm>

namespace bslam::session {
namespace {

constexpr double kLate = 1.0;         // number of frames behind above which the level is raised
constexpr double kInTime = 0.2;       // maximum number of frames behind at which a frame is in time
constexpr double kEffective_s = 0.2;  // time until a change takes effect

}  // namespace

int LoadControl::update(double behind, TimeNs time_ns) {
  if (behind > kInTime) calm_since_ns_ = time_ns;
  const bool late = behind > kLate, still_late = late && was_late_;
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
