#include "solver/rig_terms.h"

#include <algorithm>

#include "matrix/row_update.h"

namespace bslam::solver {

RigTerms::RigTerms(const BundleStructure& structure, std::size_t num_cameras, const RigBlocks& blocks,
                   int frame_unknowns)
    : structure_(structure), blocks_(blocks), ranges_(num_cameras) {
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
  for (std::size_t c = 0; c < num_cameras; ++c) {
    std::ptrdiff_t columns = 0;
    for (const Run& range : ranges_[c]) columns += range.size;
    columns_ = std::max(columns_, columns);
    const auto common = [&](const Run& a) { return [&a](const Run& b) { return a.unknown == b.unknown; }; };
    std::size_t first = 0;
    const auto shares = [&](const std::vector<Run>& other) {
      return std::ranges::any_of(ranges_[c],
                                 [&](const Run& range) { return std::ranges::any_of(other, common(range)); });
    };
    while (first < c && !shares(ranges_[first])) ++first;
    sharing_.push_back(first == c ? c : sharing_[first]);
  }
  if (size > 0) find_couplings(structure);
}

// Finds the unknowns on which the observations of each point depend.
void RigTerms::find_couplings(const BundleStructure& structure) {
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

void RigTerms::begin_points(const PointRange& range) {
  range_ = range;
  const std::size_t terms = structure_.groups[structure_.points[range.end].first_group].first_term - range.first_term;
  added_.resize(terms);
  J_.resize(std::max(J_.size(), 2 * static_cast<std::size_t>(columns_) * terms));
  U_.resize(std::max(U_.size(), 3 * (first_coupling_[range.end] - first_coupling_[range.begin])));
}

void RigTerms::begin_point(std::size_t point) {
  std::fill_n(W_.data() + 3 * first_coupling_[point], 3 * num_coupled(point), 0.0);
}

// With J = d pixel / d rig and G = [-[P']x  I]: H += w J^T J, b += w J^T e, border += G^T A^T w J, W += R^T A^T w J.
void RigTerms::add(std::size_t term, const RigObservation& observation, const Matrix23d& A, const Vector2d& e,
                   double weight, const Point& point) {
  double* J = J_.data() + 2 * columns_ * static_cast<std::ptrdiff_t>(term - range_.first_term);
  int column = 0;
  for (const auto& block : blocks_) {
    const int size = block->columns(observation.camera).size;
    if (size == 0) continue;
    block->evaluate(observation, Eigen::Map<RigBlock::Jacobian, 0, Eigen::OuterStride<>>(
                                     J + column, 2, size, Eigen::OuterStride<>(columns_)));
    column += size;
  }
  const Matrix32d wAt = weight * A.transpose();
  add_to_point(point.index, ranges_[static_cast<std::size_t>(observation.camera)], point.R_rig_world.transpose() * wAt,
               J);
  Added& added = added_[term - range_.first_term];
  added.camera = observation.camera;
  added.pose_offset = point.pose_offset;
  added.weight = weight;
  added.weighted_error = weight * e;
  added.to_pose << geometry::skew(point.point_rig) * wAt, wAt;
}

void RigTerms::add_to_point(std::size_t point, std::span<const Run> ranges, const Matrix32d& to_point,
                            const double* J) {
  const std::span<const Run> runs = runs_of(point);
  double* W = W_.data() + 3 * first_coupling_[point];
  std::size_t run = 0;
  for (const Run& range : ranges) {  // both are in the order of the unknowns
    while (range.unknown >= runs[run].unknown + runs[run].size) ++run;
    matrix::add_product_2({to_point.data(), 3, J, columns_, 3, range.size},
                          W + runs[run].first + (range.unknown - runs[run].unknown), num_coupled(point));
    J += range.size;
  }
}

void RigTerms::accumulate(std::size_t share, std::size_t shares) {
  std::vector<double> weighted_J(2 * static_cast<std::size_t>(columns_));
  for (std::size_t k = 0; k < added_.size(); ++k) {
    const Added& term = added_[k];
    if (term.camera < 0 || sharing_[static_cast<std::size_t>(term.camera)] % shares != share) continue;
    accumulate(term, J_.data() + 2 * columns_ * static_cast<std::ptrdiff_t>(k), weighted_J.data());
  }
}

void RigTerms::accumulate(const Added& term, const double* J, double* weighted_J) {
  const std::vector<Run>& ranges = ranges_[static_cast<std::size_t>(term.camera)];
  for (std::ptrdiff_t k = 0; k < 2 * columns_; ++k) weighted_J[k] = term.weight * J[k];
  const std::ptrdiff_t size = b_.size();
  std::ptrdiff_t column = 0;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const Run& range = ranges[i];
    const auto add = [&](const double* left, std::ptrdiff_t left_stride, int rows, double* C) {
      matrix::add_product_2({left, left_stride, J + column, columns_, rows, range.size}, C, size);
    };
    add(term.weighted_error.data(), 1, 1, &b_(range.unknown));
    // the columns of the lower triangle
    std::ptrdiff_t other = 0;
    for (std::size_t k = 0; k <= i; ++k) {
      add(weighted_J + other, columns_, ranges[k].size, &H_(range.unknown, ranges[k].unknown));
      other += ranges[k].size;
    }
    if (term.pose_offset >= 0) add(term.to_pose.data(), 6, 6, &border_(term.pose_offset, range.unknown));
    column += range.size;
  }
}

void RigTerms::copy_to(double damping, ReducedSystem& system) const {
  system.border() = border_;
  system.rig() = H_;
  for (Eigen::Index k = 0; k < b_.size(); ++k) system.rig()(k, k) += damping * bounded_diagonal(H_(k, k));
  system.rhs().tail(b_.size()) = b_;
}

void RigTerms::couple(std::size_t point, const Matrix3d& L) {
  const std::ptrdiff_t count = num_coupled(point);
  const double *W0 = W_.data() + 3 * first_coupling_[point], *W1 = W0 + count, *W2 = W1 + count;
  double* U0 = U_.data() + 3 * (first_coupling_[point] - first_coupling_[range_.begin]);
  double *U1 = U0 + count, *U2 = U1 + count;
  const double i0 = 1.0 / L(0, 0), i1 = 1.0 / L(1, 1), i2 = 1.0 / L(2, 2);
  for (std::ptrdiff_t k = 0; k < count; ++k) {
    U0[k] = W0[k] * i0;
    U1[k] = i1 * (W1[k] - L(1, 0) * U0[k]);
    U2[k] = i2 * (W2[k] - L(2, 0) * U0[k] - L(2, 1) * U1[k]);
  }
}

void RigTerms::eliminate_from(const PoseCoupling& pose, std::size_t point, ReducedSystem& system) const {
  const double* U = U_.data() + 3 * (first_coupling_[point] - first_coupling_[range_.begin]);
  for (const Run& run : runs_of(point))
    matrix::subtract_product_3({pose.U.data(), 6, U + run.first, num_coupled(point), 6, run.size},
                               &system.border()(pose.pose_offset, run.unknown), b_.size());
}

void RigTerms::eliminate(std::size_t point, const Vector3d& y, std::size_t share, std::size_t shares,
                         ReducedSystem& system) const {
  const double* U = U_.data() + 3 * (first_coupling_[point] - first_coupling_[range_.begin]);
  const std::span<const Run> runs = runs_of(point);
  const std::ptrdiff_t count = num_coupled(point), size = b_.size();
  const auto begin = size * static_cast<std::ptrdiff_t>(share) / static_cast<std::ptrdiff_t>(shares);
  const auto end = size * static_cast<std::ptrdiff_t>(share + 1) / static_cast<std::ptrdiff_t>(shares);
  for (std::size_t b = 0; b < runs.size(); ++b) {
    const std::ptrdiff_t first = std::max<std::ptrdiff_t>(begin, runs[b].unknown),
                         last = std::min<std::ptrdiff_t>(end, runs[b].unknown + runs[b].size);
    if (first >= last) continue;
    const double* U_b = U + runs[b].first + (first - runs[b].unknown);
    const int unknowns = static_cast<int>(last - first);
    matrix::subtract_product_3({y.data(), 1, U_b, count, 1, unknowns}, &system.rhs()(border_.rows() + first), size);
    // the columns of the lower triangle
    for (std::size_t a = b; a < runs.size(); ++a)
      matrix::subtract_product_3({U_b, count, U + runs[a].first, count, unknowns, runs[a].size},
                                 &system.rig()(runs[a].unknown, first), size);
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
