// Rebase: applies an edit to a newer version of the map than the edit's base.
#pragma once

#include <cstddef>
#include <vector>

#include "map/map_edit.h"

namespace bslam::map {

struct RebaseReport {
  std::size_t applied = 0;  // number of operations
  std::size_t dropped = 0;  // number of operations whose objects no longer exist
  // Final ids of the added keyframes and landmarks, in order of the operations; invalid if dropped.
  std::vector<KeyframeId> keyframes;
  std::vector<LandmarkId> landmarks;
};

// Applies the operations in order to `onto`, a copy of a version later than `edit.base`, by the rules of map_edit.h.
RebaseReport rebase(const MapEdit& edit, BundledMap& onto);

// Filters the matches of a new keyframe for `map`: forwards them along merges, and drops removed landmarks and repeated
// features or landmarks after the first.
std::vector<std::pair<FeatureId, LandmarkId>> usable_matches(const BundledMap& map,
                                                             std::span<const std::pair<FeatureId, LandmarkId>> matches);

}  // namespace bslam::map
