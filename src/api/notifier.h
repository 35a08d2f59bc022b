// Reports changes of the state of a System through its callbacks.
#pragma once

#include <bslam/system.h>

#include <string>
#include <vector>

#include "api/calibration_report.h"
#include "camera/rig.h"
#include "system/system.h"

namespace bslam::api {

// Must be used by one thread at a time, the one that calls process() and finish(). A callback that throws does not keep
// the others from being called: the functions report all events, each once, and return the first exception as an Error
// of `name`.
class Notifier {
 public:
  Notifier(Callbacks callbacks, const camera::Rig& rig) : callbacks_(std::move(callbacks)), rig_(rig) {}

  // Logs notes and warnings about the rig, the warnings about settings, and what is wrong with the loaded map, before
  // the first frame.
  Status started(const char* name, const Rig& rig, const std::vector<std::string>& of_settings,
                 const std::string& map_warning, bool map_without_words);
  Status processed(const char* name, const FrameResult& frame, const system::System& system);
  Status finished(const char* name, const system::System& system, const CalibrationReport& calibration);

 private:
  void report_rate(const FrameResult& frame);
  void report_status(const FrameResult& frame);
  void report_withdrawal(const FrameResult& frame);
  void report_cameras(const FrameResult& frame);
  void report_created_keyframes(const system::System& system, FrameId reported);
  void report_map(const system::System& system);
  void report_loops(const system::System& system);
  void log(LogLevel level, const std::string& line);
  template <class Callback, class... Arguments>
  void call(const Callback& callback, const Arguments&... arguments);
  void begin(const char* name);

  const Callbacks callbacks_;
  const camera::Rig rig_;
  const char* name_ = "";                     // of the call in progress, for errors
  Status failure_;                            // the first one of that call
  std::vector<std::int64_t> first_times_ns_;  // of the first frames, until their rate was checked
  TrackingStatus status_ = TrackingStatus::kNotStarted;
  std::vector<CameraResult> cameras_;  // last reported states; empty before the first frame
  int map_version_ = 0;
  std::size_t loops_ = 0;
};

}  // namespace bslam::api
