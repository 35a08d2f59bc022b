// Landmarks as search by projection wants them.
#pragma once

#include <span>
#include <vector>

#include "map/bundled_map.h"
#include "matching/projection_search.h"

namespace bslam::map {

// One point per landmark (alive), in their order. Descriptors point into `map`: valid until it changes.
std::vector<matching::SearchPoint> search_points(const BundledMap& map, std::span<const LandmarkId> landmarks);

}  // namespace bslam::map
