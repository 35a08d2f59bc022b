// The same bundle adjustment by Ceres, the reference of the tests.
#pragma once

#include "solver/bundle_adjuster.h"

namespace bslam::solver::ceres_reference {

// Minimises in place to convergence; returns the final cost (as in BundleSummary).
double adjust(ReprojectionProblem& problem, bool robust);

}  // namespace bslam::solver::ceres_reference
