// The part of a map's observations that does not depend on the scale that the map has now.
#pragma once

#include "solver/bundle_adjuster.h"

namespace bslam::mapping {

// Divides each point into one point for each group of cameras that are connected by matched features, which are
// observations of a point by several cameras at one pose. A landmark without such a connection was found in another
// camera at the place where the scale of the map predicted it: whatever was found there confirms this scale, right or
// wrong. Points that are left with one observation are removed.
solver::ReprojectionProblem without_predicted_matches(solver::ReprojectionProblem problem);

}  // namespace bslam::mapping
