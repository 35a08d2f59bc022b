#include "solver/rig_adjuster.h"

#include <algorithm>
#include <cmath>

#include "base/assert.h"
#include "solver/rig_equations.h"

namespace bslam::solver {
namespace {

constexpr double kFirstDamping = 1e-4, kMinDamping = 1e-10, kMaxDamping = 1e12;
constexpr double kNegligible = 1e-10;   // share of the cost that rounding alone may change
constexpr double kObservedShare = 0.5;  // of the prior's standard deviation
// Of two degrees of freedom cut at their 95 % bound c: the share 0.95 is left, with the variance (and its slope) 1 -
// exp(-c/2) (1 + c/2) = 0.80 of the whole (docs/math.md, section 4).
constexpr double kShareLeft = 0.95, kVarianceLeft = 0.80;

struct Round {
  Kernel kernel;
  double max_chi2;  // of observations that take part
};
constexpr std::array kRounds = {Round{Kernel::kHuber, kLostChi2}, Round{Kernel::kHuber, 16 * kChi2TwoDof95},
                                Round{Kernel::kNone, kChi2TwoDof95}, Round{Kernel::kNone, kChi2TwoDof95}};

// Levenberg-Marquardt from and to `state`; damping after Nielsen, IMM-REP-1999-05, as in bundle adjustment. Returns the
// cost, or nothing where no step could be solved for.
std::optional<double> minimise(RigEquations& equations, const RigAdjusterOptions& options, const std::stop_token& stop,
                               RigState& state) {
  double cost = equations.linearise(state), damping = kFirstDamping, growth = 2.0;
  bool any_solved = false;
  for (int i = 0; i < options.iterations && damping <= kMaxDamping && !stop.stop_requested(); ++i) {
    auto step = equations.solve(damping, state);
    any_solved |= step.has_value();
    if (step && step->predicted <= kNegligible * (1.0 + cost)) break;
    const double trial = step ? equations.cost(step->to) : cost;
    const double gain = step ? (cost - trial) / step->predicted : 0.0;
    if (!(gain > 1e-3)) {
      damping *= growth;
      growth *= 2.0;
      continue;
    }
    const double bend = 2.0 * gain - 1.0;
    damping = std::max(kMinDamping, damping * std::max(1.0 / 3.0, 1.0 - bend * bend * bend));
    growth = 2.0;
    state = std::move(step->to);
    const bool converged = cost - trial <= options.relative_decrease * cost;
    cost = equations.linearise(state);
    if (converged) break;
  }
  return any_solved ? std::optional(cost) : std::nullopt;
}

// Mean squared error of what takes part over that of the cut distribution, unknowns counted.
double variance_factor(const BundleStructure& structure, std::size_t cameras, double cost) {
  const double residuals = 2.0 * static_cast<double>(structure.terms.size());
  const double unknowns = 3.0 * static_cast<double>(structure.num_points()) +
                          6.0 * static_cast<double>(structure.pose_of_slot.size() + cameras - 1);
  const double expected = std::max(1.0, residuals - unknowns) * kVarianceLeft / kShareLeft;
  return 2.0 * cost / expected;
}

// Covariances and verdicts from the equations where they were last linearised; false where they are singular.
bool judge(RigEquations& equations, const RigAdjusterOptions& options, RigAdjustment& out) {
  const auto information = equations.extrinsic_information();
  if (!information) return false;
  const double trust = kVarianceLeft / kShareLeft / std::max(1.0, out.variance_factor);
  const Eigen::LLT<Eigen::MatrixXd> factor(trust * information->observed + information->prior);
  if (factor.info() != Eigen::Success) return false;
  const Eigen::Index size = information->prior.rows();
  const Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(size, size));
  for (std::size_t c = 1; c < out.cameras.size(); ++c) {
    ExtrinsicEstimate& camera = out.cameras[c];
    const auto at = static_cast<Eigen::Index>(6 * (c - 1));
    camera.covariance = covariance.block<6, 6>(at, at);
    for (int k = 0; k < 6; ++k) {
      const double prior = k < 3 ? options.sigma_rotation : options.sigma_translation;
      camera.observed[static_cast<std::size_t>(k)] = std::sqrt(camera.covariance(k, k)) < kObservedShare * prior;
    }
  }
  return true;
}

void check(const ReprojectionProblem& problem, const RigAdjusterOptions& options) {
  BSLAM_ASSERT(problem.rig != nullptr, "a problem needs a rig");
  BSLAM_ASSERT(options.sigma_rotation > 0 && options.sigma_translation > 0, "a standard deviation is positive");
  BSLAM_ASSERT(problem.motion.empty() || problem.motion.size() == problem.T_rig_world.size() * problem.rig->size(),
               "motion has an entry per pose and camera");
}

void report_cameras(const BundleStructure& structure, const RigState& state, const ExtrinsicPrior& prior, RigAdjustment& out) {
  for (std::size_t c = 0; c < state.T_cam_rig.size(); ++c) {
    out.cameras[c].T_cam_rig = state.T_cam_rig[c];
    out.cameras[c].change = extrinsic_change(state.T_cam_rig[c], prior.T_cam_rig[c]);
  }
  for (const BundleStructure::Term& term : structure.terms) ++out.cameras[static_cast<std::size_t>(term.camera)].observations;
}

}  // namespace

RigAdjustment adjust_rig(ReprojectionProblem& problem, const RigAdjusterOptions& options, std::span<const SE3> start,
                         std::stop_token stop) {
  check(problem, options);
  const std::size_t cameras = problem.rig->size();
  RigAdjustment out{.cameras = std::vector<ExtrinsicEstimate>(cameras)};
  out.cameras.front().observed.fill(true);
  if (cameras < 2) return out;
  ExtrinsicPrior prior{{}, options.sigma_rotation, options.sigma_translation};
  for (std::size_t c = 0; c < cameras; ++c) prior.T_cam_rig.push_back(problem.rig->cam_from_rig(c));
  RigState state{problem.T_rig_world, problem.points, prior.T_cam_rig};
  BSLAM_ASSERT(start.empty() || start.size() == cameras, "a start has extrinsics for every camera");
  if (!start.empty()) state.T_cam_rig.assign(start.begin(), start.end());
  for (std::size_t round = 0; round < kRounds.size(); ++round) {
    const std::vector<double> chi2 = squared_errors(problem, state.T_rig_world, state.points, state.T_cam_rig);
    const BundleStructure structure = make_structure(problem, chi2, beyond(chi2, kRounds[round].max_chi2));
    if (structure.num_points() == 0) return out;
    RigEquations equations(problem, structure, kRounds[round].kernel, prior);
    const auto cost = minimise(equations, options, stop, state);
    if (!cost || stop.stop_requested()) return out;
    if (round + 1 < kRounds.size()) continue;
    out.final_cost = *cost;
    out.variance_factor = variance_factor(structure, cameras, *cost);
    report_cameras(structure, state, prior, out);
    out.done = judge(equations, options, out);
  }
  if (out.done) {
    problem.T_rig_world = std::move(state.T_rig_world);
    problem.points = std::move(state.points);
  }
  return out;
}

}  // namespace bslam::solver
