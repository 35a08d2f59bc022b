#include "solver/rig_terms.h"

namespace bslam::solver {

RigTerms::RigTerms(const BundleStructure& structure, std::size_t num_cameras, const RigBlocks& blocks,
                   int frame_unknowns)
    : blocks_(blocks), unknowns_(num_cameras) {
  int size = 0;
  for (const auto& block : blocks) {
    first_of_block_.push_back(size);
    for (std::size_t c = 0; c < num_cameras; ++c) {
      const RigBlock::Range range = block->columns(static_cast<int>(c));
      for (int k = 0; k < range.size; ++k) unknowns_[c].push_back(size + range.first + k);
    }
    size += block->size();
  }
  H_.setZero(size, size);
  border_.setZero(frame_unknowns, size);
  b_.setZero(size);
  J_.setZero(2, size);
  coupling_of_.assign(static_cast<std::size_t>(size), nullptr);
  u_.resize(static_cast<std::size_t>(size));
  if (size == 0) return;
  std::vector<std::uint8_t> seen;
  for (std::size_t i = 0; i < structure.num_points(); ++i) {
    seen.assign(static_cast<std::size_t>(size), 0);
    first_coupling_.push_back(couplings_.size());
    for (const BundleStructure::Term& term : structure.terms_of(i)) {
      for (const int k : unknowns_[static_cast<std::size_t>(term.camera)]) seen[static_cast<std::size_t>(k)] = 1;
    }
    for (int k = 0; k < size; ++k) {
      if (seen[static_cast<std::size_t>(k)] != 0) couplings_.push_back({k, Vector3d::Zero()});
    }
  }
  first_coupling_.push_back(couplings_.size());
}

double RigTerms::prior_cost(const RigValues& values) const {
  double sum = 0.0;
  for (const auto& block : blocks_) sum += block->prior_cost(values);
  return sum;
}

void RigTerms::apply(const Eigen::VectorXd& delta, RigValues& values) const {
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    blocks_[i]->apply(delta.segment(first_of_block_[i], blocks_[i]->size()), values);
  }
}

void RigTerms::begin(const RigValues& values) {
  H_.setZero();
  border_.setZero();
  b_.setZero();
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const int first = first_of_block_[i], size = blocks_[i]->size();
    blocks_[i]->add_prior(values, H_.block(first, first, size, size), b_.segment(first, size));
  }
}

void RigTerms::begin_point(std::size_t point) {
  for (std::size_t k = first_coupling_[point]; k < first_coupling_[point + 1]; ++k) {
    couplings_[k].w.setZero();
    coupling_of_[static_cast<std::size_t>(couplings_[k].unknown)] = &couplings_[k];
  }
}

// With J = d pixel / d rig and G = [-[P']x  I]: H += w J^T J, b += w J^T e, border += G^T A^T w J, W += R^T A^T w J.
void RigTerms::add(const RigObservation& observation, const Matrix23d& A, const Vector2d& e, double weight,
                   const Point& point) {
  const std::vector<int>& unknowns = unknowns_[static_cast<std::size_t>(observation.camera)];
  int columns = 0;
  for (const auto& block : blocks_) {
    const int size = block->columns(observation.camera).size;
    if (size > 0) block->evaluate(observation, J_.middleCols(columns, size));
    columns += size;
  }
  for (int i = 0; i < columns; ++i) {
    const int unknown = unknowns[static_cast<std::size_t>(i)];
    const Vector2d wJ = weight * J_.col(i);
    b_(unknown) += wJ.dot(e);
    for (int k = 0; k <= i; ++k) H_(unknown, unknowns[static_cast<std::size_t>(k)]) += wJ.dot(J_.col(k));
    const Vector3d n = A.transpose() * wJ;
    coupling_of_[static_cast<std::size_t>(unknown)]->w.noalias() += point.R_rig_world.transpose() * n;
    if (point.pose_offset < 0) continue;
    border_.col(unknown).segment<3>(point.pose_offset) += point.point_rig.cross(n);
    border_.col(unknown).segment<3>(point.pose_offset + 3) += n;
  }
}

void RigTerms::copy_to(double damping, ReducedSystem& system) const {
  system.border() = border_;
  system.rig() = H_;
  for (Eigen::Index k = 0; k < b_.size(); ++k) system.rig()(k, k) += damping * bounded_diagonal(H_(k, k));
  system.rhs().tail(b_.size()) = b_;
}

void RigTerms::eliminate(std::size_t point, const Matrix3d& L, const Vector3d& y, std::span<const PoseCoupling> poses,
                         ReducedSystem& system) {
  const std::size_t first = first_coupling_[point], count = first_coupling_[point + 1] - first;
  for (std::size_t a = 0; a < count; ++a) {
    const int row = couplings_[first + a].unknown;
    u_[a] = couplings_[first + a].w;
    L.triangularView<Eigen::Lower>().solveInPlace(u_[a]);
    system.rhs()(border_.rows() + row) -= u_[a].dot(y);
    for (std::size_t b = 0; b <= a; ++b) system.rig()(row, couplings_[first + b].unknown) -= u_[a].dot(u_[b]);
    auto border = system.border().col(row);
    for (const PoseCoupling& pose : poses) border.segment<6>(pose.pose_offset).noalias() -= pose.U * u_[a];
  }
}

void RigTerms::substitute(std::size_t point, const Eigen::VectorXd& delta, Vector3d& rhs) const {
  for (std::size_t k = first_coupling_[point]; k < first_coupling_[point + 1]; ++k) {
    rhs -= delta(couplings_[k].unknown) * couplings_[k].w;
  }
}

}  // namespace bslam::solver
