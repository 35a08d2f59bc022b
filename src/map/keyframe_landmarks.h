// The landmarks that a keyframe observes.
#pragma once

#include <vector>

#include "map/bundled_map.h"

namespace bslam::map {

// In order of id, each once.
std::vector<LandmarkId> landmarks_of(const BundledMap& map, KeyframeId k);

}  // namespace bslam::map
