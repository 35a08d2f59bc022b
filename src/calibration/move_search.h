// The search for moves of cameras during a recording, with the estimate of the calibration (docs/math.md, section 16).
#pragma once

#include <vector>

#include "calibration/rig_estimate.h"

namespace bslam::calibration {

// As estimate_rig, with those of the given moves that the images show, and with further ones that they show. Further
// ones are not searched for as long as the estimate without them is not settled: what looks like moves is then a
// calibration that was not found, and every estimate with moves takes many iterations.
RigEstimate estimate_rig_and_moves(const EstimateInput& input, const RigAdjustmentOptions& prior, MovedCameras cameras);

// The moves of an estimate.
std::vector<MoveEstimate> moves_of(const RigEstimate& estimate);

}  // namespace bslam::calibration
