// Local mapping: what a new keyframe adds to the map, and what it lets go.
#pragma once

#include <stop_token>

#include "map/map_edit.h"
#include "mapping/fuse_landmarks.h"
#include "mapping/options.h"
#include "mapping/scale_observation.h"

namespace bslam::mapping {

struct MappingReport {
  int culled_landmarks = 0, created = 0, culled_keyframes = 0;
  FusionReport fusion;
  ScaleReport scale;
  adjustment::AdjustmentReport adjustment;
};

// Culls young landmarks, creates new ones, fuses duplicates, measures the scale where it is not known yet, adjusts the local
// window and culls redundant keyframes, all in `draft`. `keyframe` is alive in it.
MappingReport map_keyframe(KeyframeId keyframe, const MappingOptions& options, const FeatureModel& features,
                           map::MapDraft& draft, std::stop_token stop = {});

// Global bundle adjustment: all keyframes but the roots, all landmarks.
adjustment::AdjustmentReport adjust_globally(const MappingOptions& options, const FeatureModel& features, map::MapDraft& draft,
                                             std::stop_token stop = {});

}  // namespace bslam::mapping
