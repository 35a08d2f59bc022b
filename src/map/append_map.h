// Merging of maps: the keyframes and landmarks of one map are appended to another as further submaps.
#pragma once

#include <span>
#include <vector>

#include "map/bundled_map.h"

namespace bslam::map {

// The new ids of the keyframes and landmarks of the appended map, indexed by their old ids; invalid for those that had
// been removed. Landmarks that had been merged into another one are not forwarded.
struct AppendedIds {
  std::vector<KeyframeId> keyframes;
  std::vector<LandmarkId> landmarks;
};

// Appends all alive keyframes and landmarks of `other` to `onto` in order of id: poses, spanning trees and observations
// are kept, frames are shared, and landmark appearance is recomputed. The appended submaps share no landmarks with
// those of `onto` and keep their own world frames until merge_submaps and a correction of the poses connect them.
// Cameras that `onto` does not have are appended; for the others its calibration is used. Both maps must have the same
// pyramid. The scale and gauge epoch of `onto` are kept.
AppendedIds append_map(BundledMap& onto, const BundledMap& other);

// Builds spanning trees from keyframes `first`, `first` + 1, ..., each of which must be a separate submap: each one
// is attached to its entry in `parents`, which refers to one of these keyframes; those with an invalid parent stay
// roots. Returns false, with some keyframes already attached, if the links contain a cycle.
bool attach_keyframes(BundledMap& map, KeyframeId first, std::span<const KeyframeId> parents);

}  // namespace bslam::map
