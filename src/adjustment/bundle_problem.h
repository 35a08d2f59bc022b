// Converts a selection of the map to a bundle adjustment problem for the solver, and records where each observation
// comes from.
#pragma once

#include <vector>

#include "map/bundled_map.h"
#include "solver/bundle_adjuster.h"

namespace bslam::adjustment {

// The variables of an adjustment. Ids are alive, distinct and in ascending order. Observations by other keyframes are
// ignored.
struct Selection {
  std::vector<KeyframeId> free_keyframes, fixed_keyframes;
  std::vector<LandmarkId> landmarks;
  // the result is a correction of the map, which must not be undone by work based on older versions
  bool whole_map = false;
  std::vector<KeyframeId> with_uncertainty = {};  // free keyframes whose uncertainty is estimated
  // Information about the calibration that was given, if it has not been compared with images yet
  // (solver::BundleOptions::rig_prior).
  std::shared_ptr<const Eigen::MatrixXd> rig_prior = {};
};

// The landmark and keyframe that an observation of the problem belongs to.
struct ObservationSource {
  LandmarkId landmark;
  KeyframeId keyframe;
};

struct BundleProblem {
  solver::ReprojectionProblem problem;     // uses the map's rig
  std::vector<KeyframeId> keyframes;       // per pose
  std::vector<LandmarkId> landmarks;       // per point
  std::vector<ObservationSource> sources;  // per observation
};

// The index of each keyframe of the map in `keyframes`, by KeyframeId::index(); -1 for the others.
std::vector<int> index_by_keyframe(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes);

// Motion of the rig between each keyframe's time and the capture times of its images, without moves of cameras; empty
// if all images of all keyframes were captured at the times of the keyframes.
std::vector<geometry::SE3> motions_without_moves(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes);

// Builds the problem. Landmarks observed by fewer than two of the keyframes are ignored. `features` determines the
// standard deviation of a keypoint that is not aligned to its landmark's patch. The map must outlive the problem.
BundleProblem build_problem(const map::BundledMap& map, const Selection& selection,
                            const feature::FeatureModel& features);

// Sorts the observations, with their sources, by point, pose and camera, which is the order of build_problem.
void sort_observations(BundleProblem& problem);

}  // namespace bslam::adjustment
