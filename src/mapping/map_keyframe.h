// Local mapping: the landmarks that a new keyframe adds to the map, and the removal of old data.
#pragma once

#include <stop_token>

#include "map/map_edit.h"
#include "mapping/fuse_landmarks.h"
#include "mapping/options.h"
#include "mapping/scale_observation.h"

namespace bslam::mapping {

// Culls recent landmarks, creates new ones, fuses duplicates, estimates the scale if it is not known yet, adjusts the
// local window, and culls redundant keyframes; all changes are made in `draft`. `keyframe` must be alive in it.
// `rig_prior`: as in adjustment::Selection.
void map_keyframe(KeyframeId keyframe, const MappingOptions& options, const FeatureModel& features,
                  map::MapDraft& draft, std::stop_token stop = {},
                  std::shared_ptr<const Eigen::MatrixXd> rig_prior = {});

// Global bundle adjustment of all keyframes except the roots, and all landmarks. Returns false if nothing was adjusted;
// see adjustment::adjust_map.
bool adjust_globally(const MappingOptions& options, const FeatureModel& features, map::MapDraft& draft,
                     std::stop_token stop = {});

}  // namespace bslam::mapping
