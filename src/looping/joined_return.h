// Finds returns to a place that place recognition cannot report: tracking and fusion have already matched the landmarks
// of the place, so that its keyframes are covisible neighbours and therefore no candidates.
#pragma once

#include <optional>

#include "looping/options.h"
#include "map/bundled_map.h"

namespace bslam::looping {

// Finds returns that have not been closed yet. A value type.
class JoinedReturns {
 public:
  // The earlier keyframe to whose place the rig has returned after it had lost sight of that place, if it is a
  // neighbour of `keyframe` (neighbours_of). Returns nothing while a return that has been closed continues. Keyframes
  // must come in order of their ids.
  std::optional<KeyframeId> find(const map::BundledMap& map, KeyframeId keyframe, const LoopingOptions& options);

  // Records that the return at `keyframe` has been closed.
  void closed(KeyframeId keyframe) { last_ = keyframe; }

 private:
  KeyframeId last_;  // the last keyframe of a return that has been closed
};

}  // namespace bslam::looping
