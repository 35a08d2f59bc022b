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

struct LocalView {
  std::vector<KeyframeId> keyframes;  // most shared landmarks first
  std::vector<LandmarkId> landmarks;  // all they observe, each once, those of `seeds` first
};

// Keyframes that observe the `seeds` (alive landmarks, distinct), the best of them with their covisible neighbours, and
// `reference` in any case; then all their landmarks.
LocalView make_local_view(const BundledMap& map, std::span<const LandmarkId> seeds, KeyframeId reference,
                          const LocalViewOptions& options);

}  // namespace bslam::map
