// Python functions that a System calls to report events.
#pragma once

#include <bslam/system.h>
#include <nanobind/nanobind.h>

#include <array>
#include <exception>
#include <map>
#include <thread>
#include <utility>

namespace bslam::python {

// Must not be moved while the callbacks exist, because they refer to it. All members are only used while holding the
// GIL.
class Handlers {
 public:
  // Each is a function or None.
  nanobind::object keyframe, loop, camera, log;

  // Functions for System::create(); each acquires the GIL.
  Callbacks callbacks();
  // Throws the first exception that one of the functions has raised in this thread since the last call.
  void rethrow();
  // All references to Python objects, for the garbage collector.
  std::array<nanobind::object*, 4> references() { return {&keyframe, &loop, &camera, &log}; }

 private:
  template <class... Arguments>
  void call(const nanobind::object& function, Arguments&&... arguments);

  std::map<std::thread::id, std::exception_ptr> raised_;  // the first one of each thread
};

void bind_events(nanobind::module_& module);

}  // namespace bslam::python
