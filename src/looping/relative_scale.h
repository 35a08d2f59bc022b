// The scale between two ends of a loop, where the rig does not observe it.
#pragma once

#include <optional>

#include "looping/locate.h"

namespace bslam::looping {

// Units of the place per unit of the map about `keyframe`: how far away landmarks are that both know, by the one and by the
// other, in the median. Images cannot tell it where the keyframe is back at the very spot, distances can. 1 where the map is
// metric; empty where too few landmarks tell.
std::optional<double> relative_scale(const map::BundledMap& map, KeyframeId keyframe, const Location& location);

}  // namespace bslam::looping
