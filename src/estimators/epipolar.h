// Two-view geometry of bearings on the sphere, valid for any field of view (docs/math.md,
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

// Larger of the two angles between a bearing and the epipolar plane of the other bearing, radians.
double epipolar_angle(const EpipolarPose& pose, const BearingPair& pair);

// Returns true if the closest points of the two rays are at positive distances.
bool in_front_of_both(const EpipolarPose& pose, const BearingPair& pair);

// Midpoint between the closest points of the two rays, in camera a, in units of the translation.
Eigen::Vector3d midpoint_in_a(const EpipolarPose& pose, const BearingPair& pair);

// Pose that minimises the squared Sampson angles of the pairs in `use`, by Levenberg-Marquardt over rotation (3)
// and direction of translation (2), with a Huber kernel at `knee` radians.
EpipolarPose refine_epipolar(const EpipolarPose& start, std::span<const BearingPair> pairs,
                             const std::vector<std::uint8_t>& use, double knee);

}  // namespace bslam::estimators
