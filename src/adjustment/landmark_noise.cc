#include "adjustment/landmark_noise.h"

#include <cmath>

namespace bslam::adjustment {
namespace {

// Degrees of freedom of the prior. With fewer, the variances of landmarks differ more; results hardly change between 4
// and 20.
constexpr double kPrior = 4;

}  // namespace

std::vector<double> landmark_variances(const solver::ReprojectionProblem& problem, std::span<const double> chi2,
                                       std::span<const std::uint8_t> skip) {
  std::vector<double> sum(problem.points.size(), 0.0);
  std::vector<int> count(problem.points.size(), 0);
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    if ((!skip.empty() && skip[i]) || !(chi2[i] < solver::kMaxChi2)) continue;
    sum[static_cast<std::size_t>(problem.observations[i].point)] += chi2[i];
    ++count[static_cast<std::size_t>(problem.observations[i].point)];
  }
  double all = 0, freedom = 0;
  for (std::size_t p = 0; p < sum.size(); ++p) {
    if (count[p] < 2) continue;
    all += sum[p];
    freedom += 2 * count[p] - 3;
  }
  std::vector<double> variances(sum.size(), 1.0);
  if (!(all > 0)) return variances;
  const double mean = all / freedom;
  for (std::size_t p = 0; p < sum.size(); ++p) {
    if (count[p] >= 2) variances[p] = (kPrior * mean + sum[p]) / (kPrior + 2 * count[p] - 3);
  }
  return variances;
}

void apply_variances(std::span<const double> variances, solver::ReprojectionProblem& problem) {
  for (auto& o : problem.observations)
    o.sigma *= static_cast<float>(std::sqrt(variances[static_cast<std::size_t>(o.point)]));
}

solver::BundleSummary adjust_with_variances(solver::ReprojectionProblem& problem, std::span<const double> variances,
                                            const solver::BundleOptions& options, std::span<const std::uint8_t> skip,
                                            std::stop_token stop) {
  std::vector<float> sigmas;
  sigmas.reserve(problem.observations.size());
  for (const auto& o : problem.observations) sigmas.push_back(o.sigma);
  apply_variances(variances, problem);
  solver::BundleSummary summary = solver::adjust(problem, options, skip, std::move(stop));
  for (std::size_t i = 0; i < sigmas.size(); ++i) problem.observations[i].sigma = sigmas[i];
  return summary;
}

}  // namespace bslam::adjustment
