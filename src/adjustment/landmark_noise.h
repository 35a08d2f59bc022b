// How well a landmark can be placed in images is its own: a corner on a wall to a twentieth of a pixel, one where a near edge
// crosses a far one not at all, since it is no point. What alignment claims does not tell them apart, and the errors of the
// latter do not average out: they slide along with the view, which draws the length of the map's unit after it.
//
// So each landmark gets a variance of its own, from how well its observations agree: with n of them, their squared normalised
// errors adding up to S, and all landmarks on average m per degree of freedom,
//     variance factor = (4 m + S) / (4 + 2 n - 3),
// the point taking three of its 2 n degrees of freedom: the inverse of the mean of 1/variance after S, where before it the
// variance is m with four degrees of freedom (scaled inverse chi-square; Gelman et al., Bayesian Data Analysis, section 2.6). It is
// the weight of adjustment with Student's t distribution. Observations left out as outliers do not count, which bounds S.
#pragma once

#include <span>
#include <vector>

#include "solver/bundle_adjuster.h"

namespace bslam::adjustment {

// Variance factor of each point of the problem; 1 where fewer than two observations are left. `chi2`: the squared errors at its
// present values; `skip` as for solver::adjust.
std::vector<double> landmark_variances(const solver::ReprojectionProblem& problem, std::span<const double> chi2,
                                       std::span<const std::uint8_t> skip);

// Adjusts the problem with the standard deviations of each point's observations times the root of its factor; they are
// themselves as they were afterwards.
solver::LmSummary adjust_with_variances(solver::ReprojectionProblem& problem, std::span<const double> variances,
                                            const solver::BundleOptions& options, std::span<const std::uint8_t> skip,
                                            std::stop_token stop);

}  // namespace bslam::adjustment
