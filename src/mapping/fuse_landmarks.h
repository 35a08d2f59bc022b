// Landmark fusion: the landmarks of a new keyframe are projected into its neighbours, and the landmarks of the
// neighbours into the new keyframe; landmarks that match the same feature are merged.
#pragma once

#include "map/map_edit.h"
#include "mapping/options.h"

namespace bslam::mapping {

void fuse_landmarks(KeyframeId keyframe, const FusionOptions& options, const FeatureModel& features,
                    map::MapDraft& draft);

}  // namespace bslam::mapping
