#include "solver/reduced_system.h"

#include <Eigen/Cholesky>

#include "matrix/selected_inverse.h"

namespace bslam::solver {

ReducedSystem::ReducedSystem(const matrix::BlockPattern& pattern, std::span<const int> frame_sizes, int rig_size,
                             Storage storage)
    : storage_(storage),
      frames_(pattern, frame_sizes),
      border_(Border::Zero(frames_.rows(), rig_size)),
      rig_(Eigen::MatrixXd::Zero(rig_size, rig_size)),
      rhs_(Eigen::VectorXd::Zero(frames_.rows() + rig_size)) {
  if (sparse()) sparse_.emplace(pattern, frame_sizes);
}

bool ReducedSystem::factorise() {
  if (sparse()) return sparse_->factorise(frames_);
  dense_.setZero(frames_.rows(), frames_.rows());
  frames_.copy_to(dense_);
  return Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(dense_).info() == Eigen::Success;
}

template <class Matrix>
Matrix ReducedSystem::solve_frames(Matrix B) const {
  if (sparse()) return sparse_->solve(std::move(B));
  dense_.triangularView<Eigen::Lower>().solveInPlace(B);
  dense_.triangularView<Eigen::Lower>().transpose().solveInPlace(B);
  return B;
}

// The frames are eliminated first: (C - B^T S^-1 B) x_rig = r_rig - B^T S^-1 r_frames.
bool ReducedSystem::solve(Eigen::VectorXd& delta) {
  if (!factorise()) return false;
  const Eigen::Index frames = border_.rows(), rig = border_.cols();
  delta.resize(frames + rig);
  delta.head(frames) = solve_frames<Eigen::VectorXd>(rhs_.head(frames));
  if (rig == 0) return delta.allFinite();
  const Eigen::MatrixXd X = solve_frames<Eigen::MatrixXd>(border_);
  rig_information_ = rig_.selfadjointView<Eigen::Lower>();
  rig_information_.noalias() -= border_.transpose() * X;
  const Eigen::LLT<Eigen::MatrixXd> rig_factor(rig_information_);
  if (rig_factor.info() != Eigen::Success) return false;
  delta.tail(rig) = rig_factor.solve(rhs_.tail(rig) - X.transpose() * rhs_.head(frames));
  delta.head(frames) -= X * delta.tail(rig);
  return delta.allFinite();
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
  const Eigen::SparseMatrix<double> inverse = matrix::selected_inverse(sparse_->factor());
  for (const int frame : frames) {
    geometry::Matrix6d& block = out.emplace_back();
    for (int k = 0; k < 36; ++k) {
      const auto [low, high] = std::minmax({sparse_->position(frame) + k / 6, sparse_->position(frame) + k % 6});
      block(k / 6, k % 6) = inverse.coeff(high, low);
    }
  }
  return out;
}

Eigen::MatrixXd ReducedSystem::rig_sensitivity() const { return -solve_frames<Eigen::MatrixXd>(border_); }

ReducedSystem::RigEquations ReducedSystem::rig_equations() const {
  const Eigen::MatrixXd sensitivity = rig_sensitivity();
  RigEquations out{rig_.selfadjointView<Eigen::Lower>(), rhs_.tail(rig_.rows())};
  out.information.noalias() += border_.transpose() * sensitivity;
  out.rhs.noalias() += sensitivity.transpose() * rhs_.head(border_.rows());
  return out;
}

}  // namespace bslam::solver
