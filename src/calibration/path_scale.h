// The scale of a map during an estimate of its calibration, measured by the lengths of the paths of its keyframes.
#pragma once

#include <vector>

#include "calibration/rig_problem.h"

namespace bslam::calibration {

// Sum of the distances between successive keyframes of the same group, in metres.
double path_length(const RigProblem& problem);
// Standard deviation of this sum due to the error of the calibration. `effects`: RigAdjustment::pose_effects, per pose
// of the problem and in the frame of the poses.
double path_deviation(const RigProblem& problem, const std::vector<geometry::PoseUncertainty::Effect>& effects);

// Scales the estimate so that the distances between the keyframes remain, if this changes the scale of the baselines by
// less than `scale_tolerance_percent` or the standard deviation of the scale, which counts up to 5 %. Before the call,
// the common scale of the baselines is exactly the calibrated one. Single baselines are uncertain at first, so that
// without this function each estimate would change the scale of the live trajectory. The difference that was kept is
// included in the standard deviation of the scale.
void keep_scale(const CalibrationOptions& options, RigRefinement& refinement);

}  // namespace bslam::calibration
