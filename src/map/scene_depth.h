// Distance from a keyframe to the scene.
#pragma once

#include "map/bundled_map.h"

namespace bslam::map {

// Median distance from camera 0 of a keyframe to the landmarks it observes, in metres; 0 if it observes none.
double median_depth(const BundledMap& map, KeyframeId k);

}  // namespace bslam::map
