// The scale of a map from the extrinsics of its rig, observable once the rig turns.
#pragma once

#include <optional>
#include <span>

#include "solver/bundle_adjuster.h"

namespace bslam::solver {

struct RigScale {
  double scale = 1.0;  // metres per unit of the map
  double deviation =
      0.0;  // relative standard deviation of `scale`, enlarged where residuals exceed the keypoints' sigmas
};

// One Gauss-Newton step over all free poses, all points and the length of the extrinsics in units of the map: T_cam_rig
// = [R, t / scale]. In homogeneous coordinates that length enters linearly, so one step also serves a map whose scale
// is far off. `problem` is in units of the map and stays unchanged. One pose should be fixed; more hold the shape of
// the map, which makes the deviation too small. `skip` as for adjust. Empty where the scale is not observable: all
// cameras in one place, no rotation, or an estimate that is not positive.
std::optional<RigScale> rig_scale(const ReprojectionProblem& problem, std::span<const std::uint8_t> skip = {});

}  // namespace bslam::solver
