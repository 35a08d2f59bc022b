// Selection of the variables of local and global bundle adjustment: the paper's B_L, P_L and B_F, or the whole map.
#pragma once

#include "adjustment/map_adjustment.h"
#include "mapping/options.h"

namespace bslam::mapping {

// B_L: `keyframe` and its best covisible keyframes, free. P_L: the landmarks they observe. B_F: further keyframes that
// observe these landmarks, fixed. The root is always fixed. With a single camera the scale is arbitrary, so a second
// pose is fixed to prevent scale drift. The uncertainty of `keyframe` is estimated unless its pose is fixed.
adjustment::Selection select_local(const map::BundledMap& map, KeyframeId keyframe, const LocalWindowOptions& options);

// Returns true if the scale of the map is not observable yet and the submap of `keyframe` is small enough to be
// adjusted as a whole. Fixed keyframes would fix the scale as well.
bool needs_whole_submap(const map::BundledMap& map, KeyframeId keyframe, const ScaleOptions& options);

// Selects all keyframes of the submap of `keyframe` except its root, and the landmarks they observe. No uncertainties
// are estimated: without the scale they are not determined.
adjustment::Selection select_submap(const map::BundledMap& map, KeyframeId keyframe);

// Selects all keyframes except the roots, and all landmarks. Their uncertainties are estimated if the scale is
// observable.
adjustment::Selection select_all(const map::BundledMap& map);

}  // namespace bslam::mapping
