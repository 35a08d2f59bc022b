#include "solver/extrinsic_bundle_adjustment.h"

#include <algorithm>
#include <cmath>

#include "base/assert.h"
#include "solver/bundle_equations.h"

namespace bslam::solver {
namespace {

constexpr int kDensePoses = 150;
constexpr double kObservedRatio = 0.5;  // maximum standard deviation of an observed one, relative to the prior's

struct Round {
  Kernel kernel;
  double max_chi2;  // maximum squared normalised error of observations that are used
};
constexpr std::array kRounds = {Round{Kernel::kHuber, kMaxChi2}, Round{Kernel::kHuber, 16 * kChi2TwoDof95},
                                Round{Kernel::kNone, kChi2TwoDof95}, Round{Kernel::kNone, kChi2TwoDof95}};

// Mean squared error over its expectation for the truncated distribution, corrected for the number of unknowns.
double variance_factor(const BundleStructure& structure, std::size_t cameras, double cost) {
  const double residuals = 2.0 * static_cast<double>(structure.terms.size());
  const double unknowns = 3.0 * static_cast<double>(structure.num_points()) +
                          6.0 * static_cast<double>(structure.pose_of_slot.size() + cameras - 1);
  const double expected = std::max(1.0, residuals - unknowns) * kVarianceLeft / kFractionLeft;
  return 2.0 * cost / expected;
}

// Computes covariances and observed degrees of freedom at the current values. Returns false if the information is
// singular.
bool assess(BundleEquations& equations, const RigBlock& extrinsics, const ExtrinsicAdjustmentOptions& options,
            ExtrinsicAdjustment& out) {
  equations.linearise();
  const auto information = equations.rig_information();
  if (!information) return false;
  Eigen::MatrixXd prior = Eigen::MatrixXd::Zero(information->rows(), information->cols());
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(information->rows());
  extrinsics.add_prior(equations.state().rig, prior, gradient);
  const double scale = kVarianceLeft / kFractionLeft / std::max(1.0, out.variance_factor);
  const Eigen::LLT<Eigen::MatrixXd> factor(scale * (*information - prior) + prior);
  if (factor.info() != Eigen::Success) return false;
  const Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(prior.rows(), prior.cols()));
  for (std::size_t c = 1; c < out.cameras.size(); ++c) {
    ExtrinsicEstimate& camera = out.cameras[c];
    const auto at = static_cast<Eigen::Index>(6 * (c - 1));
    camera.covariance = covariance.block<6, 6>(at, at);
    for (int k = 0; k < 6; ++k) {
      const double sigma = k < 3 ? options.sigma_rotation : options.sigma_translation;
      camera.observed[static_cast<std::size_t>(k)] = std::sqrt(camera.covariance(k, k)) < kObservedRatio * sigma;
    }
  }
  return true;
}

void report_cameras(const BundleStructure& structure, const RigValues& rig, const Rig& calibrated,
                    ExtrinsicAdjustment& out) {
  for (std::size_t c = 0; c < rig.T_cam_rig.size(); ++c) {
    out.cameras[c].T_cam_rig = rig.T_cam_rig[c];
    out.cameras[c].change = extrinsic_change(rig.T_cam_rig[c], calibrated.cam_from_rig(c));
  }
  for (const auto& term : structure.terms) ++out.cameras[static_cast<std::size_t>(term.camera)].observations;
}

}  // namespace

ExtrinsicAdjustment adjust_extrinsics(ReprojectionProblem& problem, const ExtrinsicAdjustmentOptions& options,
                                      std::span<const SE3> start, std::stop_token stop) {
  BSLAM_ASSERT(problem.rig != nullptr, "the problem must have a rig");
  BSLAM_ASSERT(options.sigma_rotation > 0 && options.sigma_translation > 0, "standard deviations must be positive");
  const std::size_t cameras = problem.rig->size();
  BSLAM_ASSERT(start.empty() || start.size() == cameras, "the initial extrinsics must have one entry per camera");
  ExtrinsicAdjustment out{.cameras = std::vector<ExtrinsicEstimate>(cameras)};
  out.cameras.front().observed.fill(true);
  if (cameras < 2) return out;
  BundleState state = state_of(problem);
  RigBlocks blocks;
  blocks.push_back(std::make_unique<ExtrinsicsBlock>(
      ExtrinsicPrior{state.rig.T_cam_rig, options.sigma_rotation, options.sigma_translation}));
  if (!start.empty()) state.rig.T_cam_rig.assign(start.begin(), start.end());
  for (const Round& round : kRounds) {
    const auto chi2 = squared_errors(problem, state.T_rig_world, state.points, state.rig.T_cam_rig);
    const BundleStructure structure = make_structure(problem, chi2, beyond(chi2, round.max_chi2));
    if (structure.num_points() == 0) return out;
    BundleEquations equations(problem, structure, blocks, round.kernel, kDensePoses, std::move(state));
    const LmSummary summary =
        minimise(equations, {.iterations = options.iterations, .relative_decrease = options.relative_decrease}, stop);
    if (!summary.usable() || stop.stop_requested()) return out;
    if (&round == &kRounds.back()) {
      out.final_cost = summary.final_cost;
      out.variance_factor = variance_factor(structure, cameras, summary.final_cost);
      report_cameras(structure, equations.state().rig, *problem.rig, out);
      out.done = assess(equations, *blocks.front(), options, out);
    }
    state = std::move(equations.state());
  }
  if (out.done) {
    problem.T_rig_world = std::move(state.T_rig_world);
    problem.points = std::move(state.points);
  }
  return out;
}

}  // namespace bslam::solver
