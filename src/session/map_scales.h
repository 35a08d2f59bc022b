// Compares the scales of maps that were merged, by the landmarks that they have in common.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "map/bundled_map.h"

namespace bslam::session {

// A map before the merge, and what became of its landmarks.
struct MapPart {
  const map::BundledMap* map = nullptr;
  std::vector<LandmarkId> landmarks;  // their ids in the merged map, by the ids in `map`; invalid if removed
};

struct ScaleComparison {
  std::size_t first = 0, second = 0;  // positions of the two maps
  double ratio = 1;                   // lengths in the second one over those in the first one
  double deviation = 0;               // relative standard deviation of the ratio
  int views = 0;                      // keyframes of the second one that see enough common landmarks

  // Whether the difference is larger than its deviation and than that of usual calibrations explains.
  bool disagrees() const;
};

// Compares every two maps of which some keyframes see landmarks that were merged with those of the other. Within such a
// view, distances between landmarks are compared, since these do not depend on the world frames.
std::vector<ScaleComparison> compare_scales(const map::BundledMap& merged, std::span<const MapPart> parts);

}  // namespace bslam::session
