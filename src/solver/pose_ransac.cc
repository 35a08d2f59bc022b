// ransac_pose: see solver/pose_solver.h. Samples of three observations give six residuals for six unknowns.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/LU>

#include "solver/pose_problem.h"

namespace bslam::solver {
namespace {

using geometry::Matrix6d;
using geometry::Vector6d;
using Sample = std::array<const PoseProblem::Item*, 3>;

struct SampleEquations {
  Vector6d error;  // normalised
  Matrix6d J;      // d error / d(left perturbation of T_rig_world)
};

std::optional<SampleEquations> evaluate(const Rig& rig, const Sample& sample, const SE3& T_rig_world) {
  SampleEquations out;
  for (int k = 0; k < 3; ++k) {
    const PoseProblem::Item& item = *sample[static_cast<std::size_t>(k)];
    const auto r = ReprojectionResidual::evaluate(rig, item.camera, T_rig_world, item.point_world, item.pixel);
    if (!r) return std::nullopt;
    out.error.segment<2>(2 * k) = r->error * item.inverse_sigma;
    out.J.middleRows<2>(2 * k) = r->J_pose * item.inverse_sigma;
  }
  return out;
}

// Newton's method with steps shortened until the error falls. Empty where it does not reach an exact solution, which is
// the usual end of a sample with an outlier in it.
std::optional<SE3> solve_minimal(const Rig& rig, const Sample& sample, const SE3& T_rig_world_guess) {
  constexpr int kSteps = 15, kHalvings = 3;
  constexpr double kSolved = 1e-6;  // squared normalised error of the three together
  SE3 T = T_rig_world_guess;
  auto equations = evaluate(rig, sample, T);
  for (int step = 0; equations && step < kSteps; ++step) {
    const double squared = equations->error.squaredNorm();
    if (squared < kSolved) return T;
    Vector6d delta = equations->J.partialPivLu().solve(-equations->error);
    if (!delta.allFinite()) return std::nullopt;
    bool better = false;
    for (int h = 0; h <= kHalvings && !better; ++h, delta *= 0.4) {
      const SE3 trial = T.perturbed(delta);
      const auto next = evaluate(rig, sample, trial);
      if (!next || !(next->error.squaredNorm() < squared)) continue;
      T = trial;
      equations = next;
      better = true;
    }
    if (!better) return std::nullopt;
  }
  return std::nullopt;
}

// Three different items among those that project at the guess.
Sample draw(std::span<const PoseProblem::Item* const> candidates, Random& random) {
  const auto n = static_cast<std::uint32_t>(candidates.size());
  std::array<std::uint32_t, 3> index{};
  do {
    for (std::uint32_t& i : index) i = random.below(n);
  } while (index[0] == index[1] || index[0] == index[2] || index[1] == index[2]);
  return {candidates[index[0]], candidates[index[1]], candidates[index[2]]};
}

}  // namespace

double samples_needed(double inlier_share, double confidence) {
  const double all_inliers = std::pow(inlier_share, 3);
  if (all_inliers >= 1.0) return 1.0;
  return std::log(1.0 - confidence) / std::log1p(-all_inliers);
}

PoseSolution ransac_pose(const Rig& rig, std::span<const PoseObservation> observations, const SE3& T_rig_world_guess,
                         const PoseSolverOptions& options, const PoseRansacOptions& ransac, Random random) {
  constexpr int kLocalSteps = 4;  // over all that agrees with a new best sample: its noise is that of three points
  PoseProblem problem(rig, observations);
  problem.select(T_rig_world_guess, std::numeric_limits<double>::max());
  std::vector<const PoseProblem::Item*> candidates;
  for (const PoseProblem::Item& item : problem.items()) {
    if (item.in_use) candidates.push_back(&item);
  }
  SE3 best = T_rig_world_guess;
  double best_cost = problem.truncated_cost(best, ransac.inlier_chi2, std::numeric_limits<double>::infinity());
  double needed = ransac.iterations;
  for (int i = 0; candidates.size() >= 3 && i < ransac.iterations && i < needed; ++i) {
    const auto T = solve_minimal(rig, draw(candidates, random), T_rig_world_guess);
    if (!T || problem.truncated_cost(*T, ransac.inlier_chi2, best_cost) >= best_cost) continue;
    problem.select(*T, ransac.inlier_chi2);
    const SE3 local = minimise(problem, *T, problem.linearise(*T, Kernel::kHuber), Kernel::kHuber, kLocalSteps, 0.1);
    const double local_cost = problem.truncated_cost(local, ransac.inlier_chi2, best_cost);
    best = local_cost < best_cost ? local : *T;
    best_cost = problem.truncated_cost(best, ransac.inlier_chi2, std::numeric_limits<double>::infinity());
    problem.select(best, ransac.inlier_chi2);
    needed = samples_needed(problem.num_in_use() / static_cast<double>(observations.size()), ransac.confidence);
  }
  return solve_rounds(problem, best, ransac.inlier_chi2, options);
}

}  // namespace bslam::solver
