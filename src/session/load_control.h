// Decides how much work is done per frame if the computer is too slow: the level of reduction
// (tracking/reduced_work.h) is raised while frames wait, and lowered after a time in which none did. Frames are dropped
// only where that does not suffice.
#pragma once

#include "base/timestamp.h"
#include "base/work.h"

namespace bslam::session {

class LoadControl {
 public:
  static constexpr double kMinPatience_s = 2, kMaxPatience_s = 32;

  // The level for the frame of `time_ns`. `behind`: number of frames by which its processing is late, which is the
  // delay `late_s` divided by the time between two frames.
  int update(double behind, double late_s, TimeNs time_ns);

 private:
  int level_ = 0;
  bool was_late_ = false;     // whether the last frame was late; a single late frame does not change the level
  TimeNs raised_ns_ = 0;      // time at which the level was last raised
  TimeNs calm_since_ns_ = 0;  // time since which no frame was late
  TimeNs lowered_ns_ = 0;     // time at which the level was last lowered
  double patience_s_ = kMinPatience_s;  // time without late frames after which the level is lowered
};

}  // namespace bslam::session
