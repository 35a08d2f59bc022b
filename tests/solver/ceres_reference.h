// Bundle adjustment by Ceres as a reference for the tests.
#pragma once

#include "solver/bundle_adjuster.h"
#include "solver/rig_block.h"

namespace bslam::solver::ceres_reference {

// Minimises in place to convergence; returns the final cost (as in LmSummary).
double adjust(ReprojectionProblem& problem, bool robust);

// The same, robust, with free extrinsics of cameras 1 to N-1 and a prior at their initial values; `T_cam_rig` becomes
// the estimate. Derivatives are numeric.
double adjust_with_extrinsics(ReprojectionProblem& problem, const ExtrinsicPrior& prior, std::vector<SE3>& T_cam_rig);

}  // namespace bslam::solver::ceres_reference
