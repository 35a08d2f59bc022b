// The velocity of keyframes whose velocity was unknown when they were created.
#pragma once

#include "map/map_edit.h"

namespace bslam::mapping {

// Sets the velocity of the root of a submap, before which there is no frame to measure it from, by linear extrapolation
// from a following keyframe: its own velocity, and the mean velocity between the two. If they are more than half a
// second apart, it is the mean velocity, and if they are far apart it stays unknown. Only if the velocity matters:
// images of the root have different capture times, or a rolling shutter.
void complete_motion_of_root(KeyframeId following, map::MapDraft& draft);

}  // namespace bslam::mapping
