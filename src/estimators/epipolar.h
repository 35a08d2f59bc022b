// Two-view geometry of bearings on the sphere: valid for any angle, also behind an image plane (docs/math.md,
// section 6).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimators/relative_pose.h"

namespace bslam::estimators {

// p_b = R_b_a p_a + t_b_a, with a translation of norm 1.
struct EpipolarPose {
  Eigen::Matrix3d R_b_a = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t_b_a = Eigen::Vector3d::UnitX();
};

// Larger of the two angles between a bearing and the epipolar plane of the other, radians.
double epipolar_angle(const EpipolarPose& pose, const BearingPair& pair);

// Do the rays come closest to each other at positive distances along both?
bool in_front_of_both(const EpipolarPose& pose, const BearingPair& pair);

// Midpoint of where the rays come closest, in camera a, in units of the translation.
Eigen::Vector3d midpoint_in_a(const EpipolarPose& pose, const BearingPair& pair);

// Pose with the least sum of squared Sampson angles over the pairs in `use`, by Levenberg-Marquardt over rotation (3)
// and direction of translation (2), with a Huber kernel at `knee` radians.
EpipolarPose refine_epipolar(const EpipolarPose& start, std::span<const BearingPair> pairs,
                             const std::vector<std::uint8_t>& use, double knee);

}  // namespace bslam::estimators
