// What the normal equations of bundle adjustment tell about the uncertainty of poses and of the rig.
#include <Eigen/Cholesky>
#include <algorithm>

#include "solver/bundle_equations.h"

namespace bslam::solver {
namespace {

// Damping of an information matrix: large enough to factorise points without parallax, small compared to a prior. It
// must be small because a common scale of all lengths is constrained by the prior only, but changes every point, each
// of which is damped.
constexpr double kInformationDamping = 1e-13;

}  // namespace

std::optional<Eigen::MatrixXd> BundleEquations::rig_information() {
  if (!reduce(kInformationDamping).solve(delta_)) return std::nullopt;
  return system_.rig_information();
}

bool BundleEquations::factorise() { return reduce(kInformationDamping).factorise(); }

int BundleEquations::slot_of(int pose) const {
  const auto slot = std::ranges::find(structure_.pose_of_slot, pose);
  return slot == structure_.pose_of_slot.end() ? -1 : static_cast<int>(slot - structure_.pose_of_slot.begin());
}

std::vector<std::optional<geometry::Matrix6d>> BundleEquations::pose_covariances(std::span<const int> poses) {
  std::vector<std::optional<Matrix6d>> out(poses.size());
  if (!factorise()) return out;
  std::vector<int> slots;
  std::vector<std::size_t> asked;  // position of each slot in `poses`
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const int slot = slot_of(poses[i]);
    if (slot < 0) continue;
    slots.push_back(slot);
    asked.push_back(i);
  }
  const std::vector<geometry::Matrix6d> covariances = system_.pose_covariances(slots);
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (covariances[i].allFinite()) out[asked[i]] = covariances[i];
  }
  return out;
}

// The rows of each of these poses; nullopt if it is not a variable, or they are not finite.
std::vector<std::optional<geometry::PoseUncertainty::Effect>> BundleEquations::rows_of(
    std::span<const int> poses, const Eigen::MatrixXd& effect) const {
  std::vector<std::optional<geometry::PoseUncertainty::Effect>> out(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const int slot = slot_of(poses[i]);
    if (slot < 0) continue;
    const auto of_pose = effect.middleRows<6>(system_.frames().offset(slot));
    if (of_pose.allFinite()) out[i] = of_pose;
  }
  return out;
}

std::vector<std::optional<geometry::PoseUncertainty::Effect>> BundleEquations::rig_effects(
    std::span<const int> poses, const Eigen::MatrixXd& rig_deviation) const {
  return rows_of(poses, system_.rig_sensitivity() * rig_deviation);
}

// Solves S_xx F_x = -(B_x L + S_xf F_f) for the effects F_x on poses x, where the effects F_f on the other poses f are
// given.
std::vector<std::optional<geometry::PoseUncertainty::Effect>> BundleEquations::rig_effects(
    std::span<const int> poses, const Eigen::MatrixXd& rig_deviation,
    std::span<const geometry::PoseUncertainty::Effect> given) {
  reduce(kInformationDamping);
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(system_.frames().rows(), system_.frames().rows());
  system_.frames().copy_to(S);
  S.triangularView<Eigen::StrictlyUpper>() = S.transpose();
  Eigen::MatrixXd effect = Eigen::MatrixXd::Zero(S.rows(), rig_deviation.cols());
  std::vector<int> sought;  // rows
  for (std::size_t slot = 0; slot < structure_.pose_of_slot.size(); ++slot) {
    const geometry::PoseUncertainty::Effect& known = given[static_cast<std::size_t>(structure_.pose_of_slot[slot])];
    const int at = system_.frames().offset(static_cast<int>(slot));
    if (known.cols() > 0) {
      effect.middleRows<6>(at) = known;
    } else {
      for (int k = 0; k < 6; ++k) sought.push_back(at + k);
    }
  }
  const Eigen::MatrixXd rhs = (-(system_.border() * rig_deviation + S * effect)).eval()(sought, Eigen::all);
  const Eigen::MatrixXd of_sought = S(sought, sought);
  const Eigen::LLT<Eigen::MatrixXd> factor(of_sought);
  if (factor.info() != Eigen::Success)
    return std::vector<std::optional<geometry::PoseUncertainty::Effect>>(poses.size());
  const Eigen::MatrixXd found = factor.solve(rhs);
  for (std::size_t i = 0; i < sought.size(); ++i) effect.row(sought[i]) = found.row(static_cast<Eigen::Index>(i));
  return rows_of(poses, effect);
}

Eigen::MatrixXd information_of_prior(const RigBlocks& blocks, const RigValues& values) {
  int size = 0, at = 0;
  for (const auto& block : blocks) size += block->size();
  Eigen::MatrixXd prior = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
  for (const auto& block : blocks) {
    block->add_prior(values, prior.block(at, at, block->size(), block->size()), gradient.segment(at, block->size()));
    at += block->size();
  }
  return prior;
}

}  // namespace bslam::solver
