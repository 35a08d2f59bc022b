// Part of a map as the flat problem of the solver: what is adjusted, and where each of its observations comes from.
#pragma once

#include <vector>

#include "map/bundled_map.h"
#include "solver/bundle_adjuster.h"

namespace bslam::adjustment {

// What takes part; ids alive, distinct, in ascending order. Observations by other keyframes are left out.
struct Selection {
  std::vector<KeyframeId> free_keyframes, fixed_keyframes;
  std::vector<LandmarkId> landmarks;
  bool whole_map = false;  // the result is a correction of the map, which nothing begun before it may undo
};

// Where an observation of the problem comes from in the map.
struct ObservationSource {
  LandmarkId landmark;
  KeyframeId keyframe;
};

struct FlatProblem {
  solver::ReprojectionProblem problem;     // its rig is the map's
  std::vector<KeyframeId> keyframes;       // per pose
  std::vector<LandmarkId> landmarks;       // per point
  std::vector<ObservationSource> sources;  // per observation
};

// Landmarks that fewer than two of the keyframes see are left out. `features` tells the
// standard deviation of a keypoint that is not aligned to its landmark's patch. The map outlives the problem.
FlatProblem flatten(const map::BundledMap& map, const Selection& selection, const feature::FeatureModel& features);

}  // namespace bslam::adjustment
