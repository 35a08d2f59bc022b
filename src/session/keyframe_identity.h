// Recognises the keyframes of one run in several maps.
#pragma once

#include <cstdint>

#include "map/bundled_map.h"

namespace bslam::session {

// A hash of the descriptors and positions of the keypoints of a keyframe: equal for the same keyframe in different
// maps, with any number of merges and further runs between them. Keyframes that other runs made from the same images
// have other hashes, since each run refines the positions of its keypoints; only runs that begin alike have equal first
// ones.
std::uint64_t identity_of(const map::BundledKeyframe& keyframe);

}  // namespace bslam::session
