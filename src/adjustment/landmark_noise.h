// Variance of the image measurements per landmark. How well a landmark can be localised depends on the landmark: a
// corner on a wall to a twentieth of a pixel; an apparent corner at which a near edge occludes a far one not at all,
// because it is not a fixed point. The uncertainty estimated by patch alignment does not distinguish the two, and the
// errors of the latter do not average out: such points slide with the viewpoint and bias the scale of the map.
//
// Therefore each landmark gets a variance factor estimated from the residuals of its n observations. With S the sum of
// their squared normalised errors and m the mean squared normalised error per degree of freedom over all landmarks,
//     variance factor = (4 m + S) / (4 + 2 n - 3),
// in which the point takes three of the 2 n degrees of freedom. This is the inverse of the posterior mean of 1/variance
// under a scaled inverse chi-square prior with scale m and four degrees of freedom (Gelman et al., Bayesian Data
// Analysis, section 2.6), and corresponds to the weights of adjustment with Student's t distribution. Observations
// excluded as outliers do not count, which bounds S.
#pragma once

#include <span>
#include <vector>

#include "solver/bundle_adjuster.h"

namespace bslam::adjustment {

// Returns the variance factor of each point; 1 if fewer than two observations remain. `chi2` holds the squared
// normalised errors at the current values; `skip` is as in solver::adjust.
std::vector<double> landmark_variances(const solver::ReprojectionProblem& problem, std::span<const double> chi2,
                                       std::span<const std::uint8_t> skip);

// Multiplies the standard deviations of each point's observations by the square root of its variance factor.
void apply_variances(std::span<const double> variances, solver::ReprojectionProblem& problem);

// Adjusts the problem with the standard deviations of each point's observations multiplied by the square root of its
// variance factor. The standard deviations are restored afterwards.
solver::BundleSummary adjust_with_variances(solver::ReprojectionProblem& problem, std::span<const double> variances,
                                            const solver::BundleOptions& options, std::span<const std::uint8_t> skip,
                                            std::stop_token stop);

}  // namespace bslam::adjustment
