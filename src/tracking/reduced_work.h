// Less work per frame, for a computer that is too slow for all of it: fewer keypoints, fewer landmarks that are
// aligned, and fewer keyframes, which are also fewer to be mapped. The work is reduced in levels, from 0 (all of it) to
// kMaxReduction. Measured on sets of 2 and 4 cameras, level 3 takes half of the time of level 0 or a little more, and
// the error of the path grows by a factor of 1 to 2.
#pragma once

#include "base/work.h"
#include "feature/extractor.h"
#include "tracking/options.h"
#include "tracking/track.h"

namespace bslam::tracking {

// Fraction of keypoints and aligned landmarks at a level.
double work_share(int level);

feature::FeatureOptions reduced(feature::FeatureOptions options, int level);
TrackingOptions reduced(TrackingOptions options, int level);

// Adapts the largest counts so far, to which those of the next frame are compared, to a change of the level: smaller
// counts are expected then, and do not mean that landmarks have left the view.
void change_level(int from, int to, TrackerState& state);

}  // namespace bslam::tracking
