// Options that determine when background stages run; part of system::Config.
#pragma once

#include <algorithm>
#include <cstddef>

#include "base/cores.h"
#include "base/options.h"

namespace bslam::execution {

// Determines when stages run, not what they compute.
enum class Mode {
  kSequential,  // each stage is run and committed before the next frame; deterministic
  kLagged,      // one thread per stage; results are used a fixed number of frames later; deterministic
  kParallel,    // one thread per stage; frames use the newest version; for live use
};

struct ExecutionOptions {
  int threads = 0;  // threads for loops over cameras; 0: number of hardware threads, at most one per camera
  int max_pending_keyframes = 3;  // queue length of a background stage; adding to a full queue waits
  // Frames wait for the first calibrations and the mapping before them (execution::awaited), if the calibration is to
  // be estimated. Not in sequential mode, which always waits, and not where frames come in real time.
  bool await_calibration = true;
  // Parallel mode: a frame waits for keyframes that were requested longer before it, and for their mapping; 0: it does
  // not wait. It bounds the age of the map, in recorded time, if a recording is processed faster than it was captured.
  // Frames that come in real time do not wait.
  double await_mapping_s = 0.3;
  // Lagged mode: a stage's result is used this number of frames after the frame at which the stage started. It should
  // be slightly longer than the stage takes, to avoid waiting; lag_global is for maps of some hundred keyframes.
  int lag_keyframe = 1, lag_map = 3, lag_loop = 5, lag_calibrate = 40, lag_global = 40;

  // Number of threads for loops over this number of cameras.
  int threads_for(std::size_t cameras) const {
    const int available = threads > 0 ? threads : processor_cores();
    return std::min(available, static_cast<int>(cameras));
  }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("threads", self.threads, Range{0, 256}, "", "threads for loops over cameras; 0: number of hardware threads",
            kCommon);
    visitor("max_pending_keyframes", self.max_pending_keyframes, Range{1, 1000}, "",
            "maximum number of keyframes waiting for a background stage", OptionNote{.formerly = "pending_keyframes"});
    visitor(
        "await_calibration", self.await_calibration, Range{}, "",
        "at the start, frames wait until the images have been compared with the calibration; ignored by bslam live and "
        "with --late drop; false by default in the C++ and Python interfaces");
    visitor(
        "await_mapping_s", self.await_mapping_s, Range{0, 1000}, "s",
        "parallel mode: frames wait for the mapping of keyframes that were requested longer before, in recorded time; "
        "0: they do not wait; ignored by bslam live and with --late drop; 0 by default in the C++ and Python "
        "interfaces");
    visitor("lag_keyframe", self.lag_keyframe, Range{1, 10}, "frames",
            "lagged mode: delay from the request of a keyframe to its use");
    visitor("lag_map", self.lag_map, Range{1, 10000}, "frames",
            "lagged mode: delay from the start of mapping to the use of its result");
    visitor("lag_loop", self.lag_loop, Range{1, 10000}, "frames",
            "lagged mode: delay from the start of loop closing to the use of its result");
    visitor("lag_calibrate", self.lag_calibrate, Range{1, 10000}, "frames",
            "lagged mode: delay from the start of a calibration to the use of its result");
    visitor("lag_global", self.lag_global, Range{1, 10000}, "frames",
            "lagged mode: delay from the start of a global adjustment to the use of its result");
  }
};

}  // namespace bslam::execution

template <>
struct bslam::EnumNames<bslam::execution::Mode> {
  static constexpr EnumName<execution::Mode> kNames[] = {{execution::Mode::kSequential, "sequential"},
                                                         {execution::Mode::kLagged, "lagged"},
                                                         {execution::Mode::kParallel, "parallel"}};
};
