// Returns to a place that tracking and fusion have joined with the new keyframes before place recognition has reported
// them: its landmarks are already observed, so that it is a neighbour and not a candidate any more.
#pragma once

#include <optional>

#include "looping/options.h"
#include "map/bundled_map.h"

namespace bslam::looping {

// Finds returns that have not been closed yet. A value type.
class JoinedReturns {
 public:
  // The earlier keyframe to whose place the rig has returned after it had lost sight of that place, if it is a
  // neighbour of `keyframe` (neighbours_of). Nothing is returned while a return that was closed goes on. Keyframes must
  // come in order of their ids.
  std::optional<KeyframeId> find(const map::BundledMap& map, KeyframeId keyframe, const LoopingOptions& options);

  // The return at `keyframe` has been closed.
  void closed(KeyframeId keyframe) { last_ = keyframe; }

 private:
  KeyframeId last_;  // the last keyframe of a return that has been closed
};

}  // namespace bslam::looping
