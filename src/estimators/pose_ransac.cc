#include "estimators/pose_ransac.h"

#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace bslam::estimators {
namespace {

using Sample = std::array<const solver::PoseProblem::Item*, 3>;

// Solves six residuals for the six unknowns, starting from the initial pose: a pose that fits the three observations
// exactly. Often returns nullopt if one of them is an outlier.
std::optional<SE3> solve_minimal(const Rig& rig, const Sample& sample, const SE3& T_rig_world_initial) {
  constexpr double kSolved = 1e-3;  // maximum norm of the normalised errors of all three
  const auto equations_at = [&](const SE3& T_rig_world) {
    solver::PoseEquations out;
    for (const solver::PoseProblem::Item* item : sample) {
      const auto r =
          solver::ReprojectionResidual::evaluate(rig, item->camera, T_rig_world, item->point_world, item->pixel);
      if (!r) return solver::PoseEquations{.cost = std::numeric_limits<double>::infinity()};
      const double information = item->inverse_sigma * item->inverse_sigma;
      out.H += information * r->J_pose.transpose() * r->J_pose;
      out.b -= information * r->J_pose.transpose() * r->error;
      out.cost += 0.5 * information * r->error.squaredNorm();
    }
    return out;
  };
  const auto plus = [](const SE3& T, const geometry::Vector6d& delta) { return T.perturbed(delta); };
  solver::SmallProblem<6, SE3, decltype(equations_at), decltype(plus)> problem(
      T_rig_world_initial, equations_at(T_rig_world_initial), equations_at, plus);
  const solver::LmSummary summary = solver::minimise(problem, {.iterations = 15,
                                                               .relative_decrease = 0.0,
                                                               .step_tolerance = kSolved,
                                                               .min_gain = 0.0,
                                                               .rule = solver::DampingRule::kOnFailure});
  if (!summary.usable() || summary.final_cost > 0.5 * kSolved * kSolved) return std::nullopt;
  return problem.state();
}

// Three different items among those that project at the initial pose.
Sample draw(std::span<const solver::PoseProblem::Item* const> candidates, Random& random) {
  const std::array<std::uint32_t, 3> index = random.three_below(static_cast<std::uint32_t>(candidates.size()));
  return {candidates[index[0]], candidates[index[1]], candidates[index[2]]};
}

}  // namespace

bool PoseSearch::offer(const SE3& T_rig_world) {
  constexpr int kSteps = 4;
  constexpr double kTolerance = 0.1;  // standard deviations
  const double cost = problem_.truncated_cost(T_rig_world, bound_, cost_);
  if (!(cost < cost_)) return false;
  best_ = T_rig_world;
  cost_ = cost;
  problem_.select(best_, bound_);
  const solver::PoseEquations equations = problem_.linearise(best_, solver::Kernel::kHuber);
  const SE3 refined = solver::refine_pose(problem_, best_, equations, solver::Kernel::kHuber, kSteps, kTolerance);
  const double refined_cost = problem_.truncated_cost(refined, bound_, cost_);
  if (refined_cost < cost_) {
    best_ = refined;
    cost_ = refined_cost;
  }
  return true;
}

double PoseSearch::inlier_ratio() {
  problem_.select(best_, bound_);
  return problem_.num_in_use() / static_cast<double>(problem_.items().size());
}

double samples_needed(double inlier_ratio, double confidence) {
  const double all_inliers = std::pow(inlier_ratio, 3);
  if (all_inliers >= 1.0) return 1.0;
  return std::log(1.0 - confidence) / std::log1p(-all_inliers);
}

solver::PoseSolution ransac_pose(const Rig& rig, std::span<const solver::PoseObservation> observations,
                                 const SE3& T_rig_world_initial, const solver::PoseSolverOptions& options,
                                 const PoseRansacOptions& ransac, Random random) {
  solver::PoseProblem problem(rig, observations);
  problem.select(T_rig_world_initial, std::numeric_limits<double>::max());
  std::vector<const solver::PoseProblem::Item*> candidates;
  for (const solver::PoseProblem::Item& item : problem.items()) {
    if (item.in_use) candidates.push_back(&item);
  }
  PoseSearch search(problem, ransac.inlier_chi2);
  search.offer(T_rig_world_initial);
  double needed = ransac.iterations;
  for (int i = 0; candidates.size() >= 3 && i < ransac.iterations && i < needed; ++i) {
    const auto T = solve_minimal(rig, draw(candidates, random), T_rig_world_initial);
    if (T && search.offer(*T)) needed = samples_needed(search.inlier_ratio(), ransac.confidence);
  }
  return solver::solve_rounds(problem, search.best(), ransac.inlier_chi2, options);
}

}  // namespace bslam::estimators
