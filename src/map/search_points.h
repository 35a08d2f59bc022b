// Landmarks as search by projection wants them.
#pragma once

#include <span>
#include <vector>

#include "frame/projection_search.h"
#include "map/bundled_map.h"

namespace bslam::map {

// One point per landmark (alive), in their order. Descriptors point into `map`: valid until it changes.
std::vector<frame::SearchPoint> search_points(const BundledMap& map, std::span<const LandmarkId> landmarks);

}  // namespace bslam::map
