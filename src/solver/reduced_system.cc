#include "solver/reduced_system.h"

#include <Eigen/Cholesky>

#include "solver/selected_inverse.h"

namespace bslam::solver {

ReducedSystem::ReducedSystem(const BlockPattern& pattern, std::span<const int> frame_sizes, int rig_size,
                             Storage storage)
    : storage_(storage),
      frames_(pattern, frame_sizes),
      border_(Border::Zero(frames_.rows(), rig_size)),
      rig_(Eigen::MatrixXd::Zero(rig_size, rig_size)),
      rhs_(Eigen::VectorXd::Zero(frames_.rows() + rig_size)) {
  if (storage == Storage::kDense) return;
  sparse_ = frames_.sparse_structure();
  sparse_factor_.analyzePattern(sparse_);
}

// The frames are eliminated first: (C - B^T S^-1 B) x_rig = r_rig - B^T S^-1 r_frames.
template <class Factor>
bool ReducedSystem::solve_with(const Factor& factor, Eigen::VectorXd& delta) {
  if (factor.info() != Eigen::Success) return false;
  const Eigen::Index frames = border_.rows(), rig = border_.cols();
  delta.resize(frames + rig);
  delta.head(frames) = factor.solve(rhs_.head(frames));
  if (rig == 0) return delta.allFinite();
  const Eigen::MatrixXd X = factor.solve(Eigen::MatrixXd(border_));
  rig_information_ = rig_.selfadjointView<Eigen::Lower>();
  rig_information_.noalias() -= border_.transpose() * X;
  const Eigen::LLT<Eigen::MatrixXd> rig_factor(rig_information_);
  if (rig_factor.info() != Eigen::Success) return false;
  delta.tail(rig) = rig_factor.solve(rhs_.tail(rig) - X.transpose() * rhs_.head(frames));
  delta.head(frames) -= X * delta.tail(rig);
  return delta.allFinite();
}

template <class Use>
bool ReducedSystem::with_factor(const Use& use) {
  if (sparse()) {
    frames_.copy_to(sparse_);
    sparse_factor_.factorize(sparse_);
    return use(sparse_factor_);
  }
  dense_.setZero(frames_.rows(), frames_.rows());
  frames_.copy_to(dense_);
  return use(Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(dense_));
}

bool ReducedSystem::solve(Eigen::VectorXd& delta) {
  return with_factor([&](const auto& factor) { return solve_with(factor, delta); });
}

bool ReducedSystem::factorise() {
  return with_factor([](const auto& factor) { return factor.info() == Eigen::Success; });
}

// With S = L L^T, the block is E^T S^-1 E = Y^T Y, Y = L^-1 E, for the six unit vectors E of the pose.
geometry::Matrix6d ReducedSystem::dense_pose_covariance(int frame) const {
  Eigen::MatrixXd Y = Eigen::MatrixXd::Zero(frames_.rows(), 6);
  Y.middleRows<6>(frames_.offset(frame)).setIdentity();
  dense_.triangularView<Eigen::Lower>().solveInPlace(Y);
  return Y.transpose() * Y;
}

std::vector<geometry::Matrix6d> ReducedSystem::pose_covariances(std::span<const int> frames) const {
  std::vector<geometry::Matrix6d> out;
  if (!sparse()) {
    for (const int frame : frames) out.push_back(dense_pose_covariance(frame));
    return out;
  }
  const Eigen::SparseMatrix<double> inverse = selected_inverse(sparse_factor_.matrixL().nestedExpression());
  const auto& position = sparse_factor_.permutationP().indices();
  for (const int frame : frames) {
    geometry::Matrix6d& block = out.emplace_back();
    for (int k = 0; k < 36; ++k) {
      const auto [low, high] =
          std::minmax(position(frames_.offset(frame) + k / 6), position(frames_.offset(frame) + k % 6));
      block(k / 6, k % 6) = inverse.coeff(high, low);
    }
  }
  return out;
}

Eigen::MatrixXd ReducedSystem::rig_sensitivity() const {
  if (sparse()) return -sparse_factor_.solve(Eigen::MatrixXd(border_));
  Eigen::MatrixXd X = -border_;
  dense_.triangularView<Eigen::Lower>().solveInPlace(X);
  dense_.triangularView<Eigen::Lower>().transpose().solveInPlace(X);
  return X;
}

ReducedSystem::RigEquations ReducedSystem::rig_equations() const {
  const Eigen::MatrixXd sensitivity = rig_sensitivity();
  RigEquations out{rig_.selfadjointView<Eigen::Lower>(), rhs_.tail(rig_.rows())};
  out.information.noalias() += border_.transpose() * sensitivity;
  out.rhs.noalias() += sensitivity.transpose() * rhs_.head(border_.rows());
  return out;
}

}  // namespace bslam::solver
