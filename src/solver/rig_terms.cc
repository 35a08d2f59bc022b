#include "solver/rig_terms.h"

#include <algorithm>

namespace bslam::solver {

RigTerms::RigTerms(const BundleStructure& structure, std::size_t num_cameras, const RigBlocks& blocks,
                   int frame_unknowns)
    : blocks_(blocks), ranges_(num_cameras) {
  int size = 0;
  for (const auto& block : blocks) {
    first_of_block_.push_back(size);
    for (std::size_t c = 0; c < num_cameras; ++c) {
      const RigBlock::Range range = block->columns(static_cast<int>(c));
      if (range.size > 0) ranges_[c].push_back({size + range.first, range.size});
    }
    size += block->size();
  }
  H_.setZero(size, size);
  border_.setZero(frame_unknowns, size);
  b_.setZero(size);
  J_.setZero(2, size);
  U_.setZero(3, size);
  column_of_.assign(static_cast<std::size_t>(size), -1);
  if (size > 0) couple(structure);
}

// Finds the unknowns on which the observations of each point depend.
void RigTerms::couple(const BundleStructure& structure) {
  const auto size = static_cast<std::size_t>(this->size());
  std::vector<std::uint8_t> seen;
  std::size_t columns = 0;
  for (std::size_t i = 0; i < structure.num_points(); ++i) {
    seen.assign(size, 0);
    for (const BundleStructure::Term& term : structure.terms_of(i)) {
      for (const Run& range : ranges_[static_cast<std::size_t>(term.camera)])
        std::fill_n(seen.begin() + range.unknown, range.size, std::uint8_t{1});
    }
    first_coupling_.push_back(columns);
    first_run_.push_back(runs_.size());
    for (std::size_t k = 0; k < size; ++k) {
      if (seen[k] == 0) continue;
      if (k == 0 || seen[k - 1] == 0)
        runs_.push_back({static_cast<int>(k), 0, static_cast<int>(columns - first_coupling_.back())});
      ++runs_.back().size;
      ++columns;
    }
  }
  first_coupling_.push_back(columns);
  first_run_.push_back(runs_.size());
  W_.setZero(3, static_cast<Eigen::Index>(columns));
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
  const auto first = static_cast<Eigen::Index>(first_coupling_[point]);
  W_.middleCols(first, static_cast<Eigen::Index>(first_coupling_[point + 1]) - first).setZero();
  for (std::size_t r = first_run_[point]; r < first_run_[point + 1]; ++r) {
    for (int k = 0; k < runs_[r].size; ++k)
      column_of_[static_cast<std::size_t>(runs_[r].unknown + k)] = first + runs_[r].first + k;
  }
}

// With J = d pixel / d rig and G = [-[P']x  I]: H += w J^T J, b += w J^T e, border += G^T A^T w J, W += R^T A^T w J.
void RigTerms::add(const RigObservation& observation, const Matrix23d& A, const Vector2d& e, double weight,
                   const Point& point) {
  int columns = 0;
  for (const auto& block : blocks_) {
    const int size = block->columns(observation.camera).size;
    if (size > 0) block->evaluate(observation, J_.middleCols(columns, size));
    columns += size;
  }
  const std::vector<Run>& ranges = ranges_[static_cast<std::size_t>(observation.camera)];
  const Eigen::Matrix<double, 3, 2> wAt = weight * A.transpose();
  const Eigen::Matrix<double, 3, 2> to_point = point.R_rig_world.transpose() * wAt;
  Eigen::Matrix<double, 6, 2> to_pose;
  to_pose << geometry::skew(point.point_rig) * wAt, wAt;
  for (std::size_t i = 0, column = 0; i < ranges.size(); ++i) {
    const Run& range = ranges[i];
    const auto J = J_.middleCols(static_cast<Eigen::Index>(column), range.size);
    column += static_cast<std::size_t>(range.size);
    b_.segment(range.unknown, range.size).noalias() += weight * J.transpose().lazyProduct(e);
    for (std::size_t k = 0, other = 0; k <= i; ++k) {
      H_.block(range.unknown, ranges[k].unknown, range.size, ranges[k].size) +=
          (weight * J.transpose()).lazyProduct(J_.middleCols(static_cast<Eigen::Index>(other), ranges[k].size));
      other += static_cast<std::size_t>(ranges[k].size);
    }
    W_.middleCols(column_of_[static_cast<std::size_t>(range.unknown)], range.size) += to_point.lazyProduct(J);
    if (point.pose_offset < 0) continue;
    border_.block(point.pose_offset, range.unknown, 6, range.size) += to_pose.lazyProduct(J);
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
  const auto first = static_cast<Eigen::Index>(first_coupling_[point]);
  const Eigen::Index count = static_cast<Eigen::Index>(first_coupling_[point + 1]) - first;
  auto U = U_.leftCols(count);
  U = W_.middleCols(first, count);
  const double i0 = 1.0 / L(0, 0), i1 = 1.0 / L(1, 1), i2 = 1.0 / L(2, 2);
  U.row(0) *= i0;
  U.row(1) = i1 * (U.row(1) - L(1, 0) * U.row(0));
  U.row(2) = i2 * (U.row(2) - L(2, 0) * U.row(0) - L(2, 1) * U.row(1));
  const std::span runs(runs_.data() + first_run_[point], first_run_[point + 1] - first_run_[point]);
  for (std::size_t a = 0; a < runs.size(); ++a) {
    const auto Ua = U.middleCols(runs[a].first, runs[a].size);
    system.rhs().segment(border_.rows() + runs[a].unknown, runs[a].size) -= Ua.transpose().lazyProduct(y);
    for (std::size_t b = 0; b <= a; ++b) {
      system.rig().block(runs[a].unknown, runs[b].unknown, runs[a].size, runs[b].size) -=
          Ua.transpose().lazyProduct(U.middleCols(runs[b].first, runs[b].size));
    }
    for (const PoseCoupling& pose : poses) {
      system.border().block(pose.pose_offset, runs[a].unknown, 6, runs[a].size) -= pose.U.lazyProduct(Ua);
    }
  }
}

void RigTerms::substitute(std::size_t point, const Eigen::VectorXd& delta, Vector3d& rhs) const {
  for (std::size_t r = first_run_[point]; r < first_run_[point + 1]; ++r) {
    const Run& run = runs_[r];
    rhs -= W_.middleCols(static_cast<Eigen::Index>(first_coupling_[point]) + run.first, run.size)
               .lazyProduct(delta.segment(run.unknown, run.size));
  }
}

}  // namespace bslam::solver
