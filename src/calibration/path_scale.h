// Keeps the scale of a map constant while its calibration is estimated, by the length of the trajectory of its
// keyframes.
#pragma once

#include <vector>

#include "calibration/rig_problem.h"

namespace bslam::calibration {

// Sum of the distances between successive keyframes of the same group, in metres.
double path_length(const RigProblem& problem);
// Standard deviation of this sum due to the error of the calibration. `effects`: RigAdjustment::pose_effects, per pose
// of the problem and in the frame of the poses.
double path_deviation(const RigProblem& problem, const std::vector<geometry::PoseUncertainty::Effect>& effects);

// Rescales the rig, poses and landmarks of the estimate so that the length of the trajectory is that of before the
// estimate. Does nothing if this would change the baselines by at least scale_tolerance_percent and by at least the
// standard deviation of the scale, capped at 5 %; without baselines, as with a single camera, the scale is arbitrary
// and always kept. Before the call, the common scale of the baselines is exactly the calibrated one. Single baselines
// are uncertain at first: without this function, every estimate would change the scale of the live trajectory. The
// factor is recorded in kept_scale, from which apply() adds it to the uncertainty of the calibration.
void keep_scale(const CalibrationOptions& options, RigRefinement& refinement);

}  // namespace bslam::calibration
