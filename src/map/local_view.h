// The part of a map near the rig, used by tracking.
#pragma once

#include <span>
#include <vector>

#include "base/options.h"
#include "map/bundled_map.h"

namespace bslam::map {

struct LocalViewOptions {
  int max_keyframes = 24;  // maximum number of keyframes whose landmarks are searched for
  int neighbours = 6;      // covisible keyframes added for each keyframe that shares landmarks with the frame

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("max_keyframes", self.max_keyframes, Range{1, 1000}, "",
            "maximum number of keyframes whose landmarks are searched for");
    visitor("neighbours", self.neighbours, Range{0, 100}, "",
            "covisible keyframes added for each keyframe that shares landmarks with the frame");
  }
};

// The keyframes that observe some of the landmarks, with their number as weight: the largest first, newer keyframes
// first if it is the same.
std::vector<Covisible> observers(const BundledMap& map, std::span<const LandmarkId> landmarks);

// Returns all landmarks observed by a selection of keyframes, each once, beginning with the `seeds` (distinct, alive
// landmarks). The keyframes are those that observe the seeds, covisible neighbours of the best of them, and always
// `reference`.
std::vector<LandmarkId> local_landmarks(const BundledMap& map, std::span<const LandmarkId> seeds, KeyframeId reference,
                                        const LocalViewOptions& options);

}  // namespace bslam::map
