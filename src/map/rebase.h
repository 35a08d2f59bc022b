// Applying an edit to a version of the map that is newer than the edit's base.
#pragma once

#include <cstddef>
#include <vector>

#include "map/map_edit.h"

namespace bslam::map {

struct RebaseReport {
  std::size_t applied = 0;  // operations
  std::size_t dropped = 0;  // operations whose objects were gone
  // Ids given to what the edit added, in order of the operations; invalid where dropped.
  std::vector<KeyframeId> keyframes;
  std::vector<LandmarkId> landmarks;
};

// Applies the operations one after the other to `onto`, a copy of a later version than `edit.base`, by the rules of
// map_edit.h.
RebaseReport rebase(const MapEdit& edit, BundledMap& onto);

// The matches a new keyframe of `map` can have: forwarded along merges, without removed landmarks, and without later ones
// of a feature or landmark that occurs twice.
std::vector<std::pair<FeatureId, LandmarkId>> usable_matches(const BundledMap& map,
                                                             std::span<const std::pair<FeatureId, LandmarkId>> matches);

}  // namespace bslam::map
