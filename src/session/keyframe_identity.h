// Recognises the keyframes of one run in several maps.
#pragma once

#include <cstdint>

#include "map/bundled_map.h"

namespace bslam::session {

// A hash of the keypoints of a keyframe: equal for the same keyframe in different maps, with any number of merges and
// further runs between them. The positions of keypoints are those that its run has refined, so that keyframes that
// other runs made from the same images are others, except for the first ones of runs that begin alike.
std::uint64_t identity_of(const map::BundledKeyframe& keyframe);

}  // namespace bslam::session
