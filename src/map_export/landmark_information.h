// Information and covariance of landmark positions. The keypoints have the standard deviations that adjustments use
// (adjustment/landmark_keypoints.h). Maps do not store that of the detector, so that its default is used.
#pragma once

#include <Eigen/Core>
#include <utility>

#include "map_export/selection.h"

namespace bslam::map_export {

// Information (inverse covariance, 1 / unit^2) about the position of a landmark, in the world, from the keypoints of
// each of two selected keyframes whose poses are constant.
std::pair<Eigen::Matrix3d, Eigen::Matrix3d> landmark_information(const Selection& selection, LandmarkId l, KeyframeId i,
                                                                 KeyframeId j);

// Covariance of the position of a landmark from all its observations in selected keyframes with constant poses.
// Infinite if they do not determine it.
Eigen::Matrix3d landmark_covariance(const Selection& selection, LandmarkId l);

}  // namespace bslam::map_export
