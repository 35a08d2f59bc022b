// Tells the callbacks of a System what changed since they were last told.
#pragma once

#include <bslam/system.h>

#include <vector>

#include "camera/rig.h"
#include "system/system.h"

namespace bslam::api {

// For one thread at a time, the one that calls process() and finish().
class Notifier {
 public:
  Notifier(Callbacks callbacks, const camera::Rig& rig) : callbacks_(std::move(callbacks)), rig_(rig) {}

  // What is to be said of the rig before the first frame.
  void started(const Rig& rig);
  void processed(const FrameResult& frame, const system::System& system);
  void finished(const system::System& system);

 private:
  void tell_status(const FrameResult& frame);
  void tell_withdrawal(const FrameResult& frame);
  void tell_cameras(const FrameResult& frame);
  void tell_map(const system::System& system);
  void tell_loops(const system::System& system);
  void log(LogLevel level, const std::string& line) const;

  const Callbacks callbacks_;
  const camera::Rig rig_;
  TrackingStatus status_ = TrackingStatus::kNotStarted;
  std::vector<CameraResult> cameras_;  // as last told; empty before the first frame
  int map_version_ = 0;
  std::size_t loops_ = 0;
};

}  // namespace bslam::api
