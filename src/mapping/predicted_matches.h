// The part of a map's observations that does not depend on the scale that the map has now.
#pragma once

#include "solver/bundle_adjuster.h"

namespace bslam::mapping {

// Divides each point into one point for each group of cameras that are connected by observations of it at one pose. A
// landmark that no other camera observed at the same time was found in another one later, at the place where the scale
// of the map predicted it: whatever was found there confirms this scale, right or wrong. At one time, matched features
// show where a landmark is; those of tracking that were predicted as well have to satisfy the epipolar constraint, and
// to leave them out costs more than they spoil. Points that are left with one observation are removed.
solver::ReprojectionProblem without_predicted_matches(solver::ReprojectionProblem problem);

}  // namespace bslam::mapping
