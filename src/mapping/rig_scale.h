// Estimates the scale of a map from the extrinsics of its rig; it is observable if the rig rotates.
#pragma once

#include <optional>

#include "solver/bundle_adjuster.h"

namespace bslam::mapping {

struct RigScale {
  double scale = 1.0;  // metres per unit of the map
  double deviation =
      0.0;  // relative standard deviation of `scale`, increased if residuals exceed the keypoints' sigmas
};

struct RigScaleOptions {
  // Standard deviation of the calibrated rotations of the cameras, rad, per axis; 0: they are exact. On a path that is
  // almost straight, cameras that are slightly turned show the same images as cameras of another distance.
  double sigma_rotation = 0.0;
  // Number of observations that carry as much information as one, because the errors of a landmark in successive images
  // are similar.
  double correlated_observations = 1.0;
};

// One Gauss-Newton step over all free poses, all points and the length of the extrinsics in units of the map: T_cam_rig
// = [R, t / scale]. The projection is linear in that length in homogeneous coordinates, so that one step suffices even
// if the scale is far off. `problem` is in units of the map and is not changed. Exactly one pose should be fixed; more
// would constrain the shape of the map and make the deviation too small. Returns nullopt if the scale is not
// observable: all cameras at one position, no rotation, or an estimate that is not positive.
std::optional<RigScale> rig_scale(const solver::ReprojectionProblem& problem, const RigScaleOptions& options = {});

}  // namespace bslam::mapping
