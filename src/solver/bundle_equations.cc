#include "solver/bundle_equations.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/thread_pool.h"
#include "matrix/outer_product.h"

namespace bslam::solver {
namespace {

// L with L L^T = V + damping * diag(V).
geometry::Matrix3d damped_cholesky(const geometry::Matrix3d& V, double damping) {
  geometry::Matrix3d L = geometry::Matrix3d::Zero();
  const double v00 = V(0, 0) + damping * bounded_diagonal(V(0, 0));
  const double v11 = V(1, 1) + damping * bounded_diagonal(V(1, 1));
  const double v22 = V(2, 2) + damping * bounded_diagonal(V(2, 2));
  L(0, 0) = std::sqrt(v00);
  L(1, 0) = V(1, 0) / L(0, 0);
  L(2, 0) = V(2, 0) / L(0, 0);
  L(1, 1) = std::sqrt(v11 - L(1, 0) * L(1, 0));
  L(2, 1) = (V(2, 1) - L(2, 0) * L(1, 0)) / L(1, 1);
  L(2, 2) = std::sqrt(v22 - L(2, 0) * L(2, 0) - L(2, 1) * L(2, 1));
  return L;
}

ReducedSystem::Storage storage_for(const BundleStructure& structure, int dense_poses) {
  return structure.pattern.size() <= dense_poses ? ReducedSystem::Storage::kDense : ReducedSystem::Storage::kSparse;
}

int rig_size(const RigBlocks& blocks) {
  int size = 0;
  for (const auto& block : blocks) size += block->size();
  return size;
}

}  // namespace

BundleState state_of(const ReprojectionProblem& problem) {
  return {problem.T_rig_world, problem.points, RigValues::of(*problem.rig)};
}

BundleEquations::BundleEquations(const ReprojectionProblem& problem, const BundleStructure& structure,
                                 const RigBlocks& rig_blocks, Kernel kernel, int dense_poses, BundleState start,
                                 ThreadPool* pool)
    : problem_(problem),
      structure_(structure),
      kernel_(kernel),
      cameras_(problem.rig->size()),
      pool_(pool),
      ranges_(point_ranges(structure)),
      state_(std::move(start)),
      trial_(state_),
      pose_blocks_(structure.pose_of_slot.size()),
      point_blocks_(structure.num_points()),
      L_(structure.num_points()),
      system_(structure.pattern, structure.frame_sizes, rig_size(rig_blocks), storage_for(structure, dense_poses)),
      rig_(structure, problem.rig->size(), rig_blocks, system_.frames().rows()),
      point_delta_(structure.num_points()) {
  std::size_t free_groups = 0;
  for (std::size_t i = 0; i < structure.num_points(); ++i) {
    first_W_.push_back(free_groups);
    for (std::size_t g = structure.points[i].first_group; g < structure.points[i + 1].first_group; ++g) {
      free_groups += structure.groups[g].slot >= 0;
    }
  }
  first_W_.push_back(free_groups);
  W_.resize(free_groups);
  std::size_t terms = 0, groups = 0, couplings = 0, points = 0;
  for (const PointRange& range : ranges_) {
    const std::size_t end = structure.points[range.end].first_group;
    terms = std::max(terms, structure.groups[end].first_term - range.first_term);
    groups = std::max(groups, end - range.first_group);
    couplings = std::max(couplings, first_W_[range.end] - first_W_[range.begin]);
    points = std::max(points, range.end - range.begin);
  }
  term_costs_.resize(terms);
  group_sums_.resize(groups);
  U_.resize(couplings);
  y_.resize(points);
}

void BundleEquations::set_poses(const BundleState& state) {
  poses_.resize(state.T_rig_world.size());
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    poses_[i] = {state.T_rig_world[i].matrix3(), state.T_rig_world[i].translation()};
  }
  if (rig_.size() == 0 && !cam_from_rig_.empty()) return;  // constant
  cam_from_rig_.clear();
  shutters_.clear();
  cam_from_rig_.reserve(poses_.size() * cameras_);
  for (std::size_t k = 0; k < poses_.size() * cameras_; ++k) {
    const SE3& T_cam_rig = state.rig.T_cam_rig[k % cameras_];
    const SE3 T = problem_.motion.empty() ? T_cam_rig : T_cam_rig * problem_.motion[k];
    cam_from_rig_.push_back({T.matrix3(), T.translation()});
    if (!problem_.twist.empty())
      shutters_.emplace_back(problem_.rig->camera(k % cameras_), state.rig.timing[k % cameras_], T,
                             problem_.twist[k / cameras_]);
  }
}

double BundleEquations::cost(const BundleState& state) {
  double sum = 0.0;
  set_poses(state);
  for (const PointRange& range : ranges_) {
    for_each_point(range, pool_, [&](std::size_t i) { cost_of_point(state, range, i); });
    const std::size_t end = structure_.groups[structure_.points[range.end].first_group].first_term;
    for (std::size_t k = range.first_term; k < end; ++k) sum += term_costs_[k - range.first_term];
  }
  return 0.5 * sum + rig_.prior_cost(state.rig);
}

void BundleEquations::cost_of_point(const BundleState& state, const PointRange& range, std::size_t i) {
  const Vector3d& point = state.points[static_cast<std::size_t>(structure_.points[i].point)];
  for (std::size_t g = structure_.points[i].first_group; g < structure_.points[i + 1].first_group; ++g) {
    const Rigid& pose = poses_[static_cast<std::size_t>(structure_.groups[g].pose)];
    const Vector3d point_rig = pose.R * point + pose.t;
    for (std::size_t k = structure_.groups[g].first_term; k < structure_.groups[g + 1].first_term; ++k) {
      const BundleStructure::Term& term = structure_.terms[k];
      const auto error =
          residual_error(state.rig.models[static_cast<std::size_t>(term.camera)],
                         in_camera(structure_.groups[g].pose, term, point_rig), term.pixel.cast<double>());
      term_costs_[k - range.first_term] = kernel_cost(
          kernel_, error ? (term.inverse_sigma * *error).squaredNorm() : std::numeric_limits<double>::infinity());
    }
  }
}

void BundleEquations::sum_group(std::size_t point, std::size_t group, const Rigid& pose, GroupSums& sums) {
  sums.M.setZero();
  sums.m.setZero();
  sums.cost = 0.0;
  const int slot = structure_.groups[group].slot;
  const RigTerms::Point of_rig{point, sums.point_rig, pose.R, slot < 0 ? -1 : system_.frames().offset(slot)};
  for (std::size_t k = structure_.groups[group].first_term; k < structure_.groups[group + 1].first_term; ++k) {
    const BundleStructure::Term& term = structure_.terms[k];
    const Rigid& T = cam_from_rig(structure_.groups[group].pose, term.camera);
    const Vector3d p = in_camera(structure_.groups[group].pose, term, sums.point_rig);
    const auto camera = static_cast<std::size_t>(term.camera);
    const auto r = residual(state_.rig.models[camera], p, term.pixel.cast<double>());
    Vector2d e = Vector2d::Zero();
    double chi2 = kMaxChi2;
    if (r) {
      e = term.inverse_sigma * r->error;
      chi2 = e.squaredNorm();
    }
    sums.cost += kernel_cost(kernel_, chi2);
    if (!(chi2 < kMaxChi2)) {
      if (rig_.size() > 0) rig_.leave_out(k);
      continue;
    }
    const double weight = kernel_weight(kernel_, chi2);
    const Matrix23d J = term.inverse_sigma * r->J;
    const Matrix23d A = at_capture(J, structure_.groups[group].pose, term) * T.R;
    const Matrix23d wA = weight * A;
    sums.M.noalias() += A.transpose() * wA;
    sums.m.noalias() += wA.transpose() * e;
    if (rig_.size() == 0) continue;
    const RowMotion row = row_motion(structure_.groups[group].pose, term, p);
    rig_.add(k, {term.camera, state_.rig, p, J, row.velocity, row.relative_row, term.inverse_sigma}, A, e, weight,
             of_rig);
  }
}

// With G = [-[P']x  I]: V = sum of R^T M R, b = sum of R^T m, and W = G^T M R for each free pose, rotation first.
void BundleEquations::linearise_point(const PointRange& range, std::size_t i) {
  if (rig_.size() > 0) rig_.begin_point(i);
  const Vector3d& point = state_.points[static_cast<std::size_t>(structure_.points[i].point)];
  PointBlock block{Matrix3d::Zero(), Vector3d::Zero()};
  std::size_t next_W = first_W_[i];
  for (std::size_t g = structure_.points[i].first_group; g < structure_.points[i + 1].first_group; ++g) {
    const BundleStructure::Group& group = structure_.groups[g];
    const Rigid& pose = poses_[static_cast<std::size_t>(group.pose)];
    GroupSums& sums = group_sums_[g - range.first_group];
    sums.point_rig = pose.R * point + pose.t;
    sum_group(i, g, pose, sums);
    block.b.noalias() += pose.R.transpose() * sums.m;
    if (group.slot < 0) {
      const Matrix3d MR = sums.M * pose.R;
      block.V.noalias() += pose.R.transpose() * MR;
    } else {
      Matrix63d& W = W_[next_W++];
      sums.PM = geometry::skew(sums.point_rig) * sums.M;
      W.topRows<3>().noalias() = sums.PM * pose.R;
      W.bottomRows<3>().noalias() = sums.M * pose.R;
      block.V.noalias() += pose.R.transpose() * W.bottomRows<3>();
    }
  }
  point_blocks_[i] = block;
}

// H += G^T M G, b += G^T m for every shares-th pose.
void BundleEquations::add_to_poses(const PointRange& range, std::size_t share, std::size_t shares) {
  const std::size_t end = structure_.points[range.end].first_group;
  for (std::size_t g = range.first_group; g < end; ++g) {
    const int slot = structure_.groups[g].slot;
    if (slot < 0 || static_cast<std::size_t>(slot) % shares != share) continue;
    const GroupSums& sums = group_sums_[g - range.first_group];
    PoseBlock& pose = pose_blocks_[static_cast<std::size_t>(slot)];
    pose.H.topLeftCorner<3, 3>().noalias() -= sums.PM * geometry::skew(sums.point_rig);
    pose.H.bottomLeftCorner<3, 3>() += sums.PM.transpose();  // the upper triangle is not stored
    pose.H.bottomRightCorner<3, 3>() += sums.M;
    pose.b.head<3>() += sums.point_rig.cross(sums.m);
    pose.b.tail<3>() += sums.m;
  }
}

double BundleEquations::linearise() {
  set_poses(state_);
  for (PoseBlock& block : pose_blocks_) {
    block.H.setZero();
    block.b.setZero();
  }
  if (rig_.size() > 0) rig_.begin(state_.rig);
  double sum = 0.0;
  for (const PointRange& range : ranges_) {
    if (rig_.size() > 0) rig_.begin_points(range);
    for_each_point(range, pool_, [&](std::size_t i) { linearise_point(range, i); });
    for_each_share(pool_, [&](std::size_t share, std::size_t shares) {
      add_to_poses(range, share, shares);
      if (rig_.size() > 0) rig_.accumulate(share, shares);
    });
    for (std::size_t g = range.first_group; g < structure_.points[range.end].first_group; ++g)
      sum += group_sums_[g - range.first_group].cost;
  }
  return 0.5 * sum + rig_.prior_cost(state_.rig);
}

// L L^T = V, y = L^-1 b and U = W L^-T.
void BundleEquations::factorise_point(const PointRange& range, std::size_t point, double damping) {
  const Matrix3d L = damped_cholesky(point_blocks_[point].V, damping);
  L_[point] = L;
  const double i0 = 1.0 / L(0, 0), i1 = 1.0 / L(1, 1), i2 = 1.0 / L(2, 2);
  Vector3d& y = y_[point - range.begin];
  y = point_blocks_[point].b;
  L.triangularView<Eigen::Lower>().solveInPlace(y);
  std::size_t next = first_W_[point];
  for (std::size_t g = structure_.points[point].first_group; next < first_W_[point + 1]; ++g) {
    const int slot = structure_.groups[g].slot;
    if (slot < 0) continue;
    RigTerms::PoseCoupling& coupling = U_[next - first_W_[range.begin]];
    const Matrix63d& W = W_[next++];
    Matrix63d& U = coupling.U;
    U.col(0) = W.col(0) * i0;
    U.col(1) = (W.col(1) - L(1, 0) * U.col(0)) * i1;
    U.col(2) = (W.col(2) - L(2, 0) * U.col(0) - L(2, 1) * U.col(1)) * i2;
    coupling.slot = slot;
    coupling.pose_offset = system_.frames().offset(slot);
  }
  if (rig_.size() > 0) rig_.couple(point, L);
}

// Eliminates the point from the equations of every shares-th pose a: S_ab -= U_a U_b^T, r_a -= U_a y.
void BundleEquations::eliminate_point(const PointRange& range, std::size_t point, std::size_t share,
                                      std::size_t shares) {
  const int* block = structure_.pair_block.data() + structure_.points[point].first_pair;
  const std::span<const RigTerms::PoseCoupling> of_point(U_.data() + (first_W_[point] - first_W_[range.begin]),
                                                         first_W_[point + 1] - first_W_[point]);
  const Vector3d& y = y_[point - range.begin];
  for (std::size_t a = 0; a < of_point.size(); block += ++a) {
    const RigTerms::PoseCoupling& coupling = of_point[a];
    if (static_cast<std::size_t>(coupling.slot) % shares != share) continue;
    system_.rhs().segment<6>(coupling.pose_offset).noalias() -= coupling.U * y;
    for (std::size_t b = 0; b <= a; ++b) {
      auto S = system_.frames().leading<6>(block[b]);
      if (S.outerStride() == 6) {
        matrix::subtract_outer_product(coupling.U, of_point[b].U, S.data());
      } else {
        S.noalias() -= coupling.U.lazyProduct(of_point[b].U.transpose());
      }
    }
    if (rig_.size() > 0) rig_.eliminate_from(coupling, point, system_);
  }
  if (rig_.size() > 0) rig_.eliminate(point, y, share, shares, system_);
}

ReducedSystem& BundleEquations::reduce(double damping) {
  system_.frames().set_zero();
  for (std::size_t slot = 0; slot < pose_blocks_.size(); ++slot) {
    const int at = static_cast<int>(slot);
    auto block = system_.frames().leading<6>(structure_.pattern.index(at, at));
    block = pose_blocks_[slot].H;
    for (int k = 0; k < 6; ++k) block(k, k) += damping * bounded_diagonal(block(k, k));
    system_.rhs().segment<6>(system_.frames().offset(at)) = pose_blocks_[slot].b;
  }
  if (rig_.size() > 0) rig_.copy_to(damping, system_);
  for (const PointRange& range : ranges_) {
    if (rig_.size() > 0) rig_.begin_points(range);
    for_each_point(range, pool_, [&](std::size_t i) { factorise_point(range, i, damping); });
    for_each_share(pool_, [&](std::size_t share, std::size_t shares) {
      for (std::size_t i = range.begin; i < range.end; ++i) eliminate_point(range, i, share, shares);
    });
  }
  return system_;
}

// V delta_p = b - sum of W^T delta over the point's free poses and the rig.
Vector3d BundleEquations::point_update(std::size_t point) const {
  Vector3d rhs = point_blocks_[point].b;
  std::size_t next_W = first_W_[point];
  for (std::size_t g = structure_.points[point].first_group; next_W < first_W_[point + 1]; ++g) {
    const int slot = structure_.groups[g].slot;
    if (slot >= 0) rhs.noalias() -= W_[next_W++].transpose() * delta_.segment<6>(system_.frames().offset(slot));
  }
  if (rig_.size() > 0) rig_.substitute(point, delta_.tail(rig_.size()), rhs);
  L_[point].triangularView<Eigen::Lower>().solveInPlace(rhs);
  L_[point].transpose().triangularView<Eigen::Upper>().solveInPlace(rhs);
  return rhs;
}

// The predicted decrease is 1/2 delta^T (b + damping D delta).
std::optional<double> BundleEquations::solve(double damping) {
  if (!reduce(damping).solve(delta_)) return std::nullopt;
  trial_ = state_;
  double gain = 0.0;
  for (std::size_t slot = 0; slot < pose_blocks_.size(); ++slot) {
    const Vector6d delta = delta_.segment<6>(system_.frames().offset(static_cast<int>(slot)));
    const PoseBlock& block = pose_blocks_[slot];
    gain += delta.dot(block.b);
    for (int k = 0; k < 6; ++k) gain += damping * bounded_diagonal(block.H(k, k)) * delta(k) * delta(k);
    SE3& T = trial_.T_rig_world[static_cast<std::size_t>(structure_.pose_of_slot[slot])];
    T = T.perturbed(delta);
  }
  if (rig_.size() > 0) {
    const Eigen::VectorXd delta = delta_.tail(rig_.size());
    gain += delta.dot(rig_.b());
    for (int k = 0; k < rig_.size(); ++k) gain += damping * bounded_diagonal(rig_.H()(k, k)) * delta(k) * delta(k);
    rig_.apply(delta, trial_.rig);
  }
  for (const PointRange& range : ranges_)
    for_each_point(range, pool_, [&](std::size_t i) { point_delta_[i] = point_update(i); });
  for (std::size_t i = 0; i < structure_.num_points(); ++i) {
    const Vector3d& delta = point_delta_[i];
    const PointBlock& block = point_blocks_[i];
    gain += delta.dot(block.b);
    for (int k = 0; k < 3; ++k) gain += damping * bounded_diagonal(block.V(k, k)) * delta(k) * delta(k);
    trial_.points[static_cast<std::size_t>(structure_.points[i].point)] += delta;
  }
  if (!std::isfinite(gain)) return std::nullopt;
  return 0.5 * gain;
}

}  // namespace bslam::solver
