// Fusion: the landmarks of a new keyframe are looked for in its neighbours and theirs in it; what turns out to be one
// landmark becomes one.
#pragma once

#include "map/map_edit.h"
#include "mapping/options.h"

namespace bslam::mapping {

using mapping::FusionReport;

FusionReport fuse_landmarks(KeyframeId keyframe, const FusionOptions& options, const FeatureModel& features,
                            map::MapDraft& draft);

}  // namespace bslam::mapping
