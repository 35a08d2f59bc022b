// The landmarks that a keyframe observes.
#pragma once

#include <vector>

#include "map/bundled_map.h"

namespace bslam::map {

// In order of id, each once.
std::vector<LandmarkId> landmarks_of(const BundledMap& map, KeyframeId k);

// Per camera of the rig, how many of them it observes.
std::vector<int> landmarks_by_camera(const BundledKeyframe& keyframe);

}  // namespace bslam::map
