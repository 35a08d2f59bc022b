#include "api/notifier.h"

#include <fmt/format.h>

#include "api/frame_conversion.h"
#include "api/guard.h"
#include "api/map_view_impl.h"

namespace bslam::api {

void Notifier::begin(const char* name) {
  name_ = name;
  failure_ = {};
}

template <class Callback, class... Arguments>
void Notifier::call(const Callback& callback, const Arguments&... arguments) {
  if (!callback) return;
  const Status called = guarded(name_, [&]() -> Status {
    callback(arguments...);
    return {};
  });
  if (failure_) failure_ = called;
}

void Notifier::log(LogLevel level, const std::string& line) { call(callbacks_.log, level, line); }

Status Notifier::started(const char* name, const Rig& rig, const std::vector<std::string>& of_settings,
                         const std::string& map_warning, bool map_without_words) {
  begin(name);
  for (const std::string& note : rig.notes()) log(LogLevel::kInfo, "rig: " + note);
  for (const std::string& warning : rig.warnings()) log(LogLevel::kWarning, "rig: " + warning);
  for (const std::string& warning : of_settings) log(LogLevel::kWarning, warning);
  if (!map_warning.empty()) log(LogLevel::kWarning, "map: the run that made it has found: " + map_warning);
  if (map_without_words) log(LogLevel::kWarning, "map: it has no visual words, so that the rig cannot be found in it");
  return failure_;
}

// Warns once of stamps that cannot be nanoseconds.
void Notifier::report_rate(const FrameResult& frame) {
  constexpr std::size_t kFrames = 20;
  constexpr double kMostFrames_hz = 2000;
  if (first_times_ns_.size() >= kFrames) return;
  first_times_ns_.push_back(frame.time_ns);
  const double interval_s = to_seconds(frame.time_ns - first_times_ns_.front()) / (kFrames - 1);
  if (first_times_ns_.size() < kFrames || interval_s * kMostFrames_hz >= 1) return;
  log(LogLevel::kWarning, fmt::format("{:.0f} frames per second according to their times, which are in nanoseconds: "
                                      "check their unit",
                                      1 / interval_s));
}

void Notifier::report_status(const FrameResult& frame) {
  if (frame.status == status_) return;
  const double time_s = to_seconds(frame.time_ns);
  if (frame.tracking()) {
    log(LogLevel::kInfo, fmt::format("{:.3f} s: tracking, submap {}", time_s, frame.submap));
  } else {
    log(LogLevel::kWarning, fmt::format("{:.3f} s: {}: {}", time_s, to_string(frame.status), to_string(frame.reason)));
  }
  status_ = frame.status;
}

void Notifier::report_withdrawal(const FrameResult& frame) {
  if (!frame.map_withdrawn) return;
  loops_ = 0;  // its loops are forgotten
  log(LogLevel::kWarning, fmt::format("{:.3f} s: the initial map was wrong; it and all poses so far are discarded",
                                      to_seconds(frame.time_ns)));
}

void Notifier::report_cameras(const FrameResult& frame) {
  if (cameras_.empty()) cameras_.resize(frame.cameras.size());
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    const CameraResult& now = frame.cameras[c];
    const CameraResult before = cameras_[c];
    if (now.state == before.state && now.reason == before.reason) continue;
    cameras_[c] = now;
    const LogLevel level = now.state == CameraState::kOk ? LogLevel::kInfo : LogLevel::kWarning;
    log(level, fmt::format("{:.3f} s: camera {} ({}) is {}{}{}", to_seconds(frame.time_ns), c, rig_.camera(c).name,
                           to_string(now.state), now.reason.empty() ? "" : ": ", now.reason));
    call(callbacks_.camera, CameraEvent{c, frame.time_ns, before, now});
  }
}

void Notifier::report_loops(const system::System& system) {
  const std::vector<system::LoopRecord> loops = system.loops();
  for (; loops_ < loops.size(); ++loops_) {
    const system::LoopRecord& loop = loops[loops_];
    const looping::LoopClosure& closure = loop.closure;
    log(LogLevel::kInfo, fmt::format("{:.3f} s: loop closed with {:.3f} s{}", to_seconds(loop.time_ns),
                                     to_seconds(loop.with_time_ns), closure.merged ? ", submaps merged" : ""));
    call(callbacks_.loop, LoopEvent{closure.keyframe.value(), closure.matched_keyframe.value(), loop.time_ns,
                                    loop.with_time_ns, closure.inliers, closure.merged});
  }
}

void Notifier::report_map(const system::System& system) {
  map::MapSnapshot map = system.snapshot();
  const int version = map->version().value();
  if (version == map_version_) return;
  map_version_ = version;
  report_loops(system);
  if (callbacks_.map) call(callbacks_.map, make_map_view(std::move(map)));
}

// `reported`: the frame whose keyframe is already reported with its result.
void Notifier::report_created_keyframes(const system::System& system, FrameId reported) {
  if (!callbacks_.keyframe) return;
  for (const tracking::FrameRecord& record : system.created_keyframes()) {
    if (record.result.frame == reported) continue;
    const FrameResult frame = to_frame_result(record, rig_);
    call(callbacks_.keyframe, KeyframeEvent{frame.keyframe_id, frame});
  }
}

Status Notifier::processed(const char* name, const FrameResult& frame, const system::System& system) {
  begin(name);
  report_rate(frame);
  report_status(frame);
  report_withdrawal(frame);
  report_cameras(frame);
  report_created_keyframes(system, FrameId(frame.frame));
  if (frame.keyframe) call(callbacks_.keyframe, KeyframeEvent{frame.keyframe_id, frame});
  report_map(system);
  return failure_;
}

Status Notifier::finished(const char* name, const system::System& system, const CalibrationReport& calibration) {
  begin(name);
  report_created_keyframes(system, FrameId());
  report_map(system);
  report_loops(system);
  for (const std::string& warning : calibration.warnings) log(LogLevel::kWarning, warning);
  return failure_;
}

}  // namespace bslam::api
