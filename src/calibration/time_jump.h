// Cameras whose images have other time stamps from some time of a recording on: they were out for a while and came back
// with stamps that are one image late, for example. While the rig moves, this looks like a move of the camera.
#pragma once

#include <optional>
#include <vector>

#include "base/timestamp.h"
#include "map/bundled_map.h"
#include "solver/rig_block.h"

namespace bslam::calibration {

struct RigProblem;

// From a keyframe on, the images of a camera were taken at other times than before, relative to their time stamps.
struct TimeJump {
  std::size_t camera = 0;
  TimeNs time_ns = 0;  // of the first keyframe after the jump
  // If poses, points and extrinsics before the jump stay as they are: how much later the images were taken than their
  // stamps say, and twice the decrease of the cost. Since poses and points were adjusted as if there was no jump, the
  // shift is too small.
  double shift_s = 0;
  double chi2 = 0;
};

// The most likely jump of a camera of the problem, whether it happened or not. `values`: the optimum for constant
// extrinsics. With the change a_k of the extrinsics per second of delay in keyframe k, by the velocity of the rig, this
// is the best change a_k shift of all keyframes from the jump on, together with one change that all keyframes share
// (docs/math.md, section 16). Only jumps at `from` or later count. Returns nullopt if too few images are before or
// after any time.
std::optional<TimeJump> likely_jump(const map::BundledMap& map, const RigProblem& problem,
                                    const solver::RigValues& values, std::size_t camera, TimeNs from);

}  // namespace bslam::calibration
