// The landmarks that a keyframe observes.
#pragma once

#include <vector>

#include "map/bundled_map.h"

namespace bslam::map {

// In order of id, each once.
std::vector<LandmarkId> landmarks_of(const BundledMap& map, KeyframeId k);

// Number of landmarks of the keyframe that each camera observes.
std::vector<int> landmarks_by_camera(const BundledKeyframe& keyframe);

}  // namespace bslam::map
