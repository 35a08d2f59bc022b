// Keypoints that show a landmark but were refused because the geometry they were judged by was wrong.
#pragma once

#include <span>

#include "adjustment/bundle_problem.h"
#include "feature/feature_model.h"

namespace bslam::calibration {

// Looks for every point of the problem in every image of its keyframes, under the extrinsics `T_cam_rig` (one per
// camera) and the problem's own poses and points, and adds what is found as observations, those not aligned. Only
// keypoints without a landmark, in the map or the problem, are taken; only of keyframes that do not see the point with
// that camera yet. Bounds are wide: whoever adjusts next judges. Returns how many were added.
int recover_observations(const map::BundledMap& map, std::span<const geometry::SE3> T_cam_rig,
                         const feature::FeatureModel& features, adjustment::BundleProblem& flat);

}  // namespace bslam::calibration
