// Creates landmarks from features without one, by matching any camera of the new keyframe to any camera of its
// covisible neighbours.
#pragma once

#include "map/map_edit.h"
#include "mapping/options.h"

namespace bslam::mapping {

void create_landmarks(KeyframeId keyframe, const CreationOptions& options, const FeatureModel& features,
                      map::MapDraft& draft);

}  // namespace bslam::mapping
