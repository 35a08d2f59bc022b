// What local and global bundle adjustment choose: the paper's B_L, P_L and B_F, and everything.
#pragma once

#include "adjustment/map_adjustment.h"
#include "mapping/options.h"

namespace bslam::mapping {

// B_L: `keyframe` and its best covisible keyframes, free; P_L: the landmarks they see; B_F: further keyframes that see
// them, fixed. The root is always fixed; a map of one camera, up to scale, needs a second pose held so that its scale cannot wander.
adjustment::Selection select_local(const map::BundledMap& map, KeyframeId keyframe, const LocalWindowOptions& options);

// Is the scale of the map unobservable, and the part of `keyframe` small enough to be adjusted as a whole? Everything else
// held in place would hold the scale as well.
bool needs_whole_part(const map::BundledMap& map, KeyframeId keyframe, const ScaleOptions& options);

// All keyframes of the part of `keyframe` but its root, and the landmarks they see.
adjustment::Selection select_part(const map::BundledMap& map, KeyframeId keyframe);

// All keyframes but the roots, all landmarks.
adjustment::Selection select_all(const map::BundledMap& map);

}  // namespace bslam::mapping
