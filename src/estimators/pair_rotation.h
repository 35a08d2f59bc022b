// Rotation of the second camera of a pair, about its centre, from points that both observe: for a pair whose calibrated
// rotation is wrong by a few degrees.
#pragma once

#include "estimators/epipolar.h"

namespace bslam::estimators {

struct PairRotationOptions {
  double tolerance = 4e-3;  // rad, largest distance from the epipolar plane of a match that agrees
  double prior = 0.035;     // rad, standard deviation of the given rotation, per axis
};

struct PairRotation {
  Eigen::Matrix3d correction = Eigen::Matrix3d::Identity();  // R_b_a = correction * R_b_a as given, t_b_a likewise
  // Matches that agree without and with the correction: on the epipolar plane, and in front of both cameras or too far
  // away to have a depth. `with_depth`: those of the latter that are not too far away.
  int agreed = 0, agree = 0, with_depth = 0;
};

// Matches that agree with a relative pose, as in PairRotation.
struct EpipolarAgreement {
  int all = 0, with_depth = 0;
};

EpipolarAgreement epipolar_agreement(const EpipolarPose& pose, std::span<const BearingPair> pairs, double tolerance);

// Minimises the distances of the bearings b from the epipolar planes of a, by iteratively reweighted least squares with
// the weights of Geman and McClure, whose scale decreases from several degrees to the tolerance. Directions that the
// matches do not determine, mainly the rotation that changes disparities, stay as given because of the prior. More than
// half of the pairs must be correct.
PairRotation pair_rotation(const EpipolarPose& given, std::span<const BearingPair> pairs,
                           const PairRotationOptions& options);

}  // namespace bslam::estimators
