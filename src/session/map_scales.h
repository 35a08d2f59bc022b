// Compares the scales of maps that were merged, by the landmarks that they have in common.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "map/bundled_map.h"

namespace bslam::session {

// A map before the merge, and the ids of its landmarks in the merged map.
struct MapPart {
  const map::BundledMap* map = nullptr;
  std::vector<LandmarkId> landmarks;  // indexed by the id in `map`: id in the merged map; invalid if removed
};

struct ScaleComparison {
  std::size_t first = 0, second = 0;  // indices of the two maps in `parts`
  double ratio = 1;                   // lengths in the second map divided by lengths in the first
  double deviation = 0;               // relative standard deviation of the ratio
  int views = 0;                      // keyframes of the second map that observe enough common landmarks

  // Returns true if the ratio differs from 1 by more than its uncertainty and usual calibration errors explain.
  bool disagrees() const;
};

// Compares all pairs of maps whose landmarks were merged with each other. Compares distances between landmarks that one
// keyframe observes, because distances do not depend on the world frames.
std::vector<ScaleComparison> compare_scales(const map::BundledMap& merged, std::span<const MapPart> parts);

}  // namespace bslam::session
