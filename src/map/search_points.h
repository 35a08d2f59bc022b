// Converts landmarks to the input of search by projection.
#pragma once

#include <span>
#include <vector>

#include "map/bundled_map.h"
#include "matching/projection_search.h"

namespace bslam::map {

// One point per landmark, in the same order. The landmarks must be alive. Descriptors point into `map`; they are valid
// until it changes.
std::vector<matching::SearchPoint> search_points(const BundledMap& map, std::span<const LandmarkId> landmarks);

}  // namespace bslam::map
