// Recovers keypoints that show a landmark but were rejected because of wrong extrinsics.
#pragma once

#include "calibration/rig_problem.h"
#include "feature/feature_model.h"

namespace bslam::calibration {

// Searches for every point of the problem in every image of the keyframes of its group, with the given rig (extrinsics,
// intrinsics, time offsets and readout times) and the problem's poses and points, and adds the matches as observations
// that are not aligned. Only keypoints without a landmark in the map and the problem are matched, and only in images in
// which the point is not observed yet. The thresholds are wide; the next adjustment has to classify the observations.
// Returns the number of added ones.
int recover_observations(const map::BundledMap& map, const camera::Rig& rig, const feature::FeatureModel& features,
                         RigProblem& problem);

}  // namespace bslam::calibration
