// Information and covariance of landmark positions.
#pragma once

#include <Eigen/Core>

#include "map_export/selection.h"

namespace bslam::map_export {

// Information (inverse covariance, 1 / unit^2) about the position of a landmark, in the world, from the keypoints of
// one feature of a keyframe whose pose is constant.
Eigen::Matrix3d keypoint_information(const map::BundledMap& map, KeyframeId k, LandmarkId l, FeatureId f);

// Covariance of the position of a landmark from all its observations in selected keyframes with constant poses.
// Infinite if they do not determine it.
Eigen::Matrix3d landmark_covariance(const Selection& selection, LandmarkId l);

}  // namespace bslam::map_export
