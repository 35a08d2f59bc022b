// Maps put together: the keyframes and landmarks of one as further parts of another.
#pragma once

#include <span>
#include <vector>

#include "map/bundled_map.h"

namespace bslam::map {

// Ids the keyframes and landmarks of the other map have got, by its slots; invalid where it had removed them. Landmarks
// it had merged are not forwarded.
struct AppendedIds {
  std::vector<KeyframeId> keyframes;
  std::vector<LandmarkId> landmarks;
};

// Appends everything alive in `other`, in order of id, to `onto`: poses, spanning trees and observations as they are,
// frames shared, what landmarks look like computed anew. Its parts share nothing with those of `onto`: they lie
// wherever their own map has them until join_parts and a correction bring them together. Both maps are of one rig and
// one pyramid; scale and gauge epoch stay those of `onto`.
AppendedIds append_map(BundledMap& onto, const BundledMap& other);

// Hangs keyframes `first`, `first` + 1, ..., each of which is a part of its own, below `parents`, which are among them;
// those with an invalid one stay roots. False, with some of them hung, where the links close a circle.
bool hang_keyframes(BundledMap& map, KeyframeId first, std::span<const KeyframeId> parents);

}  // namespace bslam::map
