// Reduces the work per frame if the computer is too slow: fewer keypoints, fewer aligned landmarks, and fewer
// keyframes, so that mapping has less work as well. There are several levels, from 0 (no reduction) to kMaxReduction.
// Measured on data sets with 2 and 4 cameras, level 3 takes half of the time of level 0 or a little more, and the error
// of the path grows by a factor of 1 to 2.
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

// Scales the largest counts so far, with which the counts of the next frame are compared, after a change of the level.
// A higher level leads to smaller counts although no landmarks have left the view.
void change_level(int from, int to, TrackerState& state);

}  // namespace bslam::tracking
