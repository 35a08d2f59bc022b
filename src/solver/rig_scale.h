// How long the unit of a map is: what the known places of several cameras on a rig say about it once the rig turns.
#pragma once

#include <optional>
#include <span>

#include "solver/bundle_adjuster.h"

namespace bslam::solver {

struct RigScale {
  double scale = 1.0;      // metres per unit of the map: all lengths of the map times this are metres
  double deviation = 0.0;  // relative standard deviation of `scale`; the keypoints' sigmas are widened where residuals tell so
};

// One Gauss-Newton step of all free poses, all points and the length of the extrinsics in units of the map, T_cam_rig
// being [R, t / scale]; in homogeneous coordinates that length enters linearly, so that one step serves a map at a wrong scale.
// Only the scale is returned: `problem`, in units of the map, stays as it is. One pose should be fixed; more hold the
// map's shape, which makes the deviation too small. `skip` as for adjust. Empty where the images do not tell: the rig has
// one centre, does not turn, or the scale would not be positive.
std::optional<RigScale> rig_scale(const ReprojectionProblem& problem, std::span<const std::uint8_t> skip = {});

}  // namespace bslam::solver
