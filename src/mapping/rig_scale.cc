#include "mapping/rig_scale.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "solver/bundle_equations.h"

namespace bslam::mapping {
namespace {

constexpr double kDamping = 1e-12;        // factor of the diagonal; points without parallax do not move
constexpr double kMinInformation = 1e-9;  // relative to the information if poses and points were known

// Derivative of the free poses with respect to a growth of the map around the first fixed pose. Images do not
// distinguish the size of the map from the length of the extrinsics, so the size is held constant.
Eigen::VectorXd growth(const solver::ReprojectionProblem& problem, const solver::BundleStructure& structure,
                       const matrix::BlockMatrix& frames) {
  const auto fixed = std::find(problem.pose_free.begin(), problem.pose_free.end(), std::uint8_t{0});
  const auto first = static_cast<std::size_t>(fixed - problem.pose_free.begin());
  const geometry::Vector3d centre = fixed == problem.pose_free.end()
                                        ? geometry::Vector3d::Zero()
                                        : problem.T_rig_world[first].inverse().translation();
  Eigen::VectorXd out = Eigen::VectorXd::Zero(frames.rows());
  for (std::size_t slot = 0; slot < structure.pose_of_slot.size(); ++slot) {
    const geometry::SE3& T = problem.T_rig_world[static_cast<std::size_t>(structure.pose_of_slot[slot])];
    out.segment<3>(frames.offset(static_cast<int>(slot)) + 3) = T * centre;
  }
  return out.normalized();
}

struct ScaleStep {
  double change = 0, information = 0;  // for the length of the extrinsics, with all other unknowns marginalised out
};

// One Gauss-Newton step; a stiff term along `growth` holds the size of the map constant. The length of the extrinsics
// is the first unknown of the rig.
std::optional<ScaleStep> scale_step(solver::ReducedSystem& system, const Eigen::VectorXd& growth) {
  const Eigen::Index frames = growth.size(), rig = system.rig().rows();
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(frames, frames);
  system.frames().copy_to(S);
  S.selfadjointView<Eigen::Lower>().rankUpdate(growth, S.diagonal().maxCoeff());
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(S);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Eigen::MatrixXd of_rig = system.rig().selfadjointView<Eigen::Lower>();
  const Eigen::LLT<Eigen::MatrixXd> information(of_rig - system.border().transpose() * factor.solve(system.border()));
  if (information.info() != Eigen::Success) return std::nullopt;
  const Eigen::VectorXd rhs =
      system.rhs().tail(rig) - system.border().transpose() * factor.solve(system.rhs().head(frames));
  const double variance = information.solve(Eigen::VectorXd::Unit(rig, 0))(0);
  return ScaleStep{information.solve(rhs)(0), 1.0 / variance};
}

// The length of all extrinsics and, unless they are exact, their rotations. The directions of the translations are
// constant. `inflation`: number of observations that carry the information that the equations assign to one.
solver::RigBlocks unknowns_of(const solver::RigValues& calibrated, double sigma_rotation, double inflation) {
  constexpr double kExactTranslation = 1e-6;  // metres
  solver::RigBlocks blocks;
  blocks.push_back(std::make_unique<solver::BaselineScaleBlock>());
  if (sigma_rotation > 0) {
    blocks.push_back(std::make_unique<solver::ExtrinsicsBlock>(
        solver::ExtrinsicPrior{.T_cam_rig = calibrated.T_cam_rig,
                               .sigma_rotation = sigma_rotation / std::sqrt(inflation),
                               .sigma_translation = kExactTranslation}));
  }
  return blocks;
}

// Weighted sum of squared errors over its expectation, at least 1. Returns nullopt if there are not more observations
// than unknowns.
std::optional<double> variance_factor(const solver::BundleStructure& structure, const std::vector<double>& chi2,
                                      const solver::ReprojectionProblem& problem) {
  std::vector<std::uint8_t> used(problem.points.size(), 0);
  for (std::size_t i = 0; i < structure.num_points(); ++i)
    used[static_cast<std::size_t>(structure.points[i].point)] = 1;
  double sum = 0.0;
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    if (!(chi2[i] < solver::kMaxChi2) || used[static_cast<std::size_t>(problem.observations[i].point)] == 0) continue;
    sum += solver::kernel_weight(solver::Kernel::kHuber, chi2[i]) * chi2[i];
  }
  const double redundancy = 2.0 * static_cast<double>(structure.terms.size()) -
                            6.0 * static_cast<double>(structure.pose_of_slot.size()) -
                            3.0 * static_cast<double>(structure.num_points());
  if (!(redundancy > 0.0)) return std::nullopt;
  return std::max(1.0, sum / redundancy);
}

}  // namespace

std::optional<RigScale> rig_scale(const solver::ReprojectionProblem& problem, const RigScaleOptions& options) {
  const std::vector<double> chi2 = solver::squared_errors(problem);
  const solver::BundleStructure structure = solver::make_structure(problem, chi2, {});
  if (structure.num_points() == 0 || structure.pose_of_slot.empty()) return std::nullopt;
  const auto variance = variance_factor(structure, chi2, problem);
  if (!variance) return std::nullopt;
  const double inflation = options.correlated_observations * *variance;
  solver::BundleState state = solver::state_of(problem);
  const solver::RigBlocks blocks = unknowns_of(state.rig, options.sigma_rotation, inflation);
  solver::BundleEquations equations(problem, structure, blocks, solver::Kernel::kHuber, std::numeric_limits<int>::max(),
                                    std::move(state));
  equations.linearise();
  solver::ReducedSystem& system = equations.reduce(kDamping);
  const Eigen::VectorXd size = growth(problem, structure, system.frames());
  const auto step = size.allFinite() ? scale_step(system, size) : std::nullopt;
  const double conditional =
      solver::bounded_diagonal(equations.rig_terms().H()(0, 0));  // information if all other unknowns were known
  if (!step || !(step->information > kMinInformation * conditional)) return std::nullopt;
  const double length = 1.0 + step->change;
  if (!(length > 0.0)) return std::nullopt;
  return RigScale{1.0 / length, std::sqrt(inflation / step->information) / length};
}

}  // namespace bslam::mapping
