// The part of a map near the rig, as the tracker needs it.
#pragma once

#include <span>
#include <vector>

#include "base/options.h"
#include "map/bundled_map.h"

namespace bslam::map {

struct LocalViewOptions {
  int max_keyframes = 24;  // whose landmarks are looked for
  int neighbours = 6;      // covisible keyframes taken along with each that shares landmarks with the frame

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("max_keyframes", self.max_keyframes, Range{1, 1000}, "", "keyframes whose landmarks are looked for");
    visitor("neighbours", self.neighbours, Range{0, 100}, "", "covisible keyframes taken along with each of them");
  }
};

// All landmarks that these keyframes observe, each once, `seeds` (alive landmarks, distinct) first: the keyframes that
// observe the seeds, the best of them with their covisible neighbours, and `reference` in any case.
std::vector<LandmarkId> local_landmarks(const BundledMap& map, std::span<const LandmarkId> seeds, KeyframeId reference,
                                        const LocalViewOptions& options);

}  // namespace bslam::map
