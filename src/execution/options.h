// Settings of when and where stages run.
#pragma once

#include "base/options.h"

namespace bslam::execution {

// When stages run, never what they compute.
enum class Mode {
  kSequential,  // each stage to its commit before the next frame: identical bytes on every run
  kLagged,      // stages in threads of their own, results seen a fixed number of frames later: identical bytes as well
  kParallel,    // stages in threads of their own, newest version wins: for live use
};

struct ExecutionOptions {
  int threads = 0;  // for loops over cameras; 0 = as many as the machine runs at once, at most one per camera
  int max_pending_keyframes = 3;  // queue length of a background stage; whoever adds to a full queue blocks
  // Lagged mode: a stage's result is seen that many frames after the one at which it began. Little more than the stage
  // takes, so that nobody waits; kGlobal's is for maps of some hundred keyframes.
  int lag_map = 3, lag_loop = 5, lag_global = 40;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("threads", self.threads, Range{0, 256}, "", "threads for loops over cameras; 0 = what the machine has",
            kCommon);
    visitor("max_pending_keyframes", self.max_pending_keyframes, Range{1, 1000}, "",
            "keyframes that may wait for a background stage", OptionNote{.formerly = "pending_keyframes"});
    visitor("lag_map", self.lag_map, Range{1, 10000}, "frames", "lagged mode: from the begin of mapping to its result");
    visitor("lag_loop", self.lag_loop, Range{1, 10000}, "frames", "lagged mode: the same of loop closing");
    visitor("lag_global", self.lag_global, Range{1, 10000}, "frames", "lagged mode: the same of global adjustment");
  }
};

}  // namespace bslam::execution

template <>
struct bslam::EnumNames<bslam::execution::Mode> {
  static constexpr EnumName<execution::Mode> kNames[] = {{execution::Mode::kSequential, "sequential"},
                                                         {execution::Mode::kLagged, "lagged"},
                                                         {execution::Mode::kParallel, "parallel"}};
};
