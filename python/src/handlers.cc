#include "handlers.h"

#include <nanobind/stl/string_view.h>

#include <string_view>

namespace bslam::python {

namespace nb = nanobind;

// An exception must not pass through the library with the lock released: it is kept until the call has ended.
template <class... Arguments>
void Handlers::call(const nb::object& function, Arguments&&... arguments) {
  const nb::gil_scoped_acquire lock;
  try {
    function(std::forward<Arguments>(arguments)...);
  } catch (nb::python_error&) {
    raised_.try_emplace(std::this_thread::get_id(), std::current_exception());
  }
}

Callbacks Handlers::callbacks() {
  Callbacks out;
  if (!keyframe.is_none()) out.keyframe = [this](const KeyframeEvent& event) { call(keyframe, event); };
  if (!loop.is_none()) out.loop = [this](const LoopEvent& event) { call(loop, event); };
  if (!camera.is_none()) out.camera = [this](const CameraEvent& event) { call(camera, event); };
  if (!log.is_none()) {
    out.log = [this](LogLevel level, std::string_view line) {
      call(log, std::string_view(level == LogLevel::kWarning ? "warning" : "info"), line);
    };
  }
  return out;
}

void Handlers::rethrow() {
  if (auto raised = raised_.extract(std::this_thread::get_id())) std::rethrow_exception(raised.mapped());
}

void bind_events(nb::module_& module) {
  nb::class_<KeyframeEvent>(module, "KeyframeEvent", "A frame became a keyframe.")
      .def_ro("keyframe", &KeyframeEvent::keyframe, "Id in the map.")
      .def_ro("frame", &KeyframeEvent::frame, "Result of its frame, which may be one before the last.");
  nb::class_<LoopEvent>(module, "LoopEvent", "A place was recognised and the map corrected.")
      .def_ro("keyframe", &LoopEvent::keyframe, "Id of the later keyframe.")
      .def_ro("with_keyframe", &LoopEvent::with, "Id of the keyframe that was recognised.")
      .def_ro("time_ns", &LoopEvent::time_ns, "Time of the frame of the later keyframe, in nanoseconds.")
      .def_ro("with_time_ns", &LoopEvent::with_time_ns, "Time of the frame of the other one, in nanoseconds.")
      .def_ro("inliers", &LoopEvent::inliers, "Number of keypoints that support the loop closure.")
      .def_ro("submaps_merged", &LoopEvent::submaps_merged, "Whether they belonged to different submaps.");
  nb::class_<CameraEvent>(module, "CameraEvent", "The state of a camera, or the reason of its state, has changed.")
      .def_ro("camera", &CameraEvent::camera, "Index in the rig.")
      .def_ro("time_ns", &CameraEvent::time_ns, "Time of the frame.")
      .def_ro("before", &CameraEvent::before, "Its CameraStatus in the frame before.")
      .def_ro("now", &CameraEvent::now, "Its CameraStatus in this frame.");
}

}  // namespace bslam::python
