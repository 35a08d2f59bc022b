// Rotation of the second camera of a pair, about its centre, from points that both observe: for a pair whose calibrated
// rotation is wrong by a few degrees.
#pragma once

#include "estimators/epipolar.h"

namespace bslam::estimators {

struct PairRotationOptions {
  double tolerance = 4e-3;    // rad, largest distance from the epipolar plane of a match that agrees
  double prior = 0.035;       // rad, standard deviation of the given rotation, per axis
  double focal_error = 0.02;  // standard deviation of the ratio of the focal lengths, relative to the given one
};

struct PairRotation {
  Eigen::Matrix3d correction = Eigen::Matrix3d::Identity();  // R_b_a = correction * R_b_a as given, t_b_a likewise
  // Matches that agree with the correction: on the epipolar plane, and in front of both cameras or too far away to have
  // a depth. `with_depth`: those of the latter that are not too far away.
  int agree = 0, with_depth = 0;
  // The correction includes a rotation that brings matches in front of the cameras: between 5 % and 85 % of those on
  // their epipolar planes were behind them.
  bool brought_to_front = false;
  // Of camera b, relative: its focal length is (1 + focal_error) times the given one. It is not part of `correction`,
  // and the counts are those without it.
  double focal_error = 0.0;
};

// Matches that agree with a relative pose, as in PairRotation.
struct EpipolarAgreement {
  int all = 0, with_depth = 0;
};

EpipolarAgreement epipolar_agreement(const EpipolarPose& pose, std::span<const BearingPair> pairs, double tolerance);

// Minimises the distances of the bearings b from the epipolar planes of a, by iteratively reweighted least squares with
// the weights of Geman and McClure, whose scale decreases from several degrees to the tolerance. An error of the focal
// lengths is estimated as well, so that it is not taken for a rotation. The rotation about the axis that is
// perpendicular to the baseline and the view changes mainly disparities. Small errors of the intrinsics, which are
// common to all matches, look like a large one of it, so that it stays as given unless clearly more matches agree with
// another one, or several matches are behind the cameras: these are then brought to about infinity. More than
// half of the pairs must be correct.
PairRotation pair_rotation(const EpipolarPose& given, std::span<const BearingPair> pairs,
                           const PairRotationOptions& options);

}  // namespace bslam::estimators
