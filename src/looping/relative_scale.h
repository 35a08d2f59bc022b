// Relative scale between the two ends of a loop, for maps whose scale is not observable.
#pragma once

#include <optional>

#include "looping/verify_place.h"

namespace bslam::looping {

// Returns the scale of the map at the place over the scale at `keyframe`: the median ratio of the distances to
// landmarks triangulated at both ends. Distances give the scale even if the keyframe returned to exactly the same
// position, in which case reprojection does not. Returns 1 if the map is metric, nullopt if too few landmarks are
// common.
std::optional<double> relative_scale(const map::BundledMap& map, KeyframeId keyframe, const PlaceMatch& place_match);

}  // namespace bslam::looping
