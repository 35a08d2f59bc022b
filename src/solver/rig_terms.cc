#include "solver/rig_terms.h"

#include <algorithm>

#include "matrix/row_update.h"

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
  wJ_.setZero(2, size);
  U_.resize(3 * static_cast<std::size_t>(size));
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
  W_.resize(3 * columns);
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
  W_of_point_ = W_.data() + 3 * first_coupling_[point];
  W_columns_ = static_cast<std::ptrdiff_t>(first_coupling_[point + 1] - first_coupling_[point]);
  std::fill_n(W_of_point_, 3 * W_columns_, 0.0);
  for (std::size_t r = first_run_[point]; r < first_run_[point + 1]; ++r) {
    for (int k = 0; k < runs_[r].size; ++k)
      column_of_[static_cast<std::size_t>(runs_[r].unknown + k)] = runs_[r].first + k;
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
  const RigBlock::Jacobian& J = J_;
  wJ_.leftCols(columns) = weight * J.leftCols(columns);
  const Eigen::Matrix<double, 3, 2> wAt = weight * A.transpose();
  const Eigen::Matrix<double, 3, 2> to_point = point.R_rig_world.transpose() * wAt;
  Eigen::Matrix<double, 6, 2> to_pose;
  to_pose << geometry::skew(point.point_rig) * wAt, wAt;
  const std::ptrdiff_t stride = J.cols(), size = b_.size();
  for (std::size_t i = 0, column = 0; i < ranges.size(); ++i) {
    const Run& range = ranges[i];
    const double* J_range = J.data() + column;
    const auto add = [&](const double* left, std::ptrdiff_t left_stride, int rows, double* C, std::ptrdiff_t C_stride) {
      matrix::add_product_2({left, left_stride, J_range, stride, rows, range.size}, C, C_stride);
    };
    const Vector2d we = weight * e;
    add(we.data(), 1, 1, &b_(range.unknown), size);
    // the columns of the lower triangle
    for (std::size_t k = 0, other = 0; k <= i; ++k) {
      add(wJ_.data() + other, stride, ranges[k].size, &H_(range.unknown, ranges[k].unknown), size);
      other += static_cast<std::size_t>(ranges[k].size);
    }
    add(to_point.data(), 3, 3, W_of_point_ + column_of_[static_cast<std::size_t>(range.unknown)], W_columns_);
    if (point.pose_offset >= 0) add(to_pose.data(), 6, 6, &border_(point.pose_offset, range.unknown), size);
    column += static_cast<std::size_t>(range.size);
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
  const auto count = static_cast<std::ptrdiff_t>(first_coupling_[point + 1] - first_coupling_[point]);
  const double *W0 = W_.data() + 3 * first_coupling_[point], *W1 = W0 + count, *W2 = W1 + count;
  double *U0 = U_.data(), *U1 = U0 + count, *U2 = U1 + count;
  const double i0 = 1.0 / L(0, 0), i1 = 1.0 / L(1, 1), i2 = 1.0 / L(2, 2);
  for (std::ptrdiff_t k = 0; k < count; ++k) {
    U0[k] = W0[k] * i0;
    U1[k] = i1 * (W1[k] - L(1, 0) * U0[k]);
    U2[k] = i2 * (W2[k] - L(2, 0) * U0[k] - L(2, 1) * U1[k]);
  }
  const std::span runs(runs_.data() + first_run_[point], first_run_[point + 1] - first_run_[point]);
  const Eigen::Index size = b_.size(), frames = border_.rows();
  for (std::size_t a = 0; a < runs.size(); ++a) {
    const auto subtract = [&](const double* left, std::ptrdiff_t left_stride, int rows, double* C) {
      matrix::subtract_product_3({left, left_stride, U0 + runs[a].first, count, rows, runs[a].size}, C, size);
    };
    subtract(y.data(), 1, 1, &system.rhs()(frames + runs[a].unknown));
    // the columns of the lower triangle
    for (std::size_t b = 0; b <= a; ++b)
      subtract(U0 + runs[b].first, count, runs[b].size, &system.rig()(runs[a].unknown, runs[b].unknown));
    for (const PoseCoupling& pose : poses)
      subtract(pose.U.data(), 6, 6, &system.border()(pose.pose_offset, runs[a].unknown));
  }
}

void RigTerms::substitute(std::size_t point, const Eigen::VectorXd& delta, Vector3d& rhs) const {
  const std::size_t count = first_coupling_[point + 1] - first_coupling_[point];
  for (std::size_t r = first_run_[point]; r < first_run_[point + 1]; ++r) {
    const Run& run = runs_[r];
    const double* W = W_.data() + 3 * first_coupling_[point] + run.first;
    for (std::size_t row = 0; row < 3; ++row)
      rhs(static_cast<Eigen::Index>(row)) -=
          Eigen::Map<const Eigen::VectorXd>(W + row * count, run.size).dot(delta.segment(run.unknown, run.size));
  }
}

}  // namespace bslam::solver
