#include "solver/bundle_equations.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "matrix/outer_product.h"

namespace bslam::solver {
namespace {

// Damping of an information matrix: large enough to factorise points without parallax, small compared to a prior. It
// must be small because a common scale of all lengths is constrained by the prior only, but changes every point, each
// of which is damped.
constexpr double kInformationDamping = 1e-13;

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
                                 const RigBlocks& rig_blocks, Kernel kernel, int dense_poses, BundleState start)
    : problem_(problem),
      structure_(structure),
      kernel_(kernel),
      cameras_(problem.rig->size()),
      state_(std::move(start)),
      trial_(state_),
      pose_blocks_(structure.pose_of_slot.size()),
      point_blocks_(structure.num_points()),
      L_(structure.num_points()),
      system_(structure.pattern, structure.frame_sizes, rig_size(rig_blocks), storage_for(structure, dense_poses)),
      rig_(structure, problem.rig->size(), rig_blocks, system_.frames().rows()) {
  std::size_t free_groups = 0, most_in_point = 0;
  for (std::size_t i = 0; i < structure.num_points(); ++i) {
    first_W_.push_back(free_groups);
    for (std::size_t g = structure.points[i].first_group; g < structure.points[i + 1].first_group; ++g) {
      free_groups += structure.groups[g].slot >= 0;
    }
    most_in_point = std::max(most_in_point, free_groups - first_W_.back());
  }
  first_W_.push_back(free_groups);
  W_.resize(free_groups);
  U_.resize(most_in_point);
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
  for (std::size_t i = 0; i < structure_.num_points(); ++i) {
    const Vector3d& point = state.points[static_cast<std::size_t>(structure_.points[i].point)];
    for (std::size_t g = structure_.points[i].first_group; g < structure_.points[i + 1].first_group; ++g) {
      const Rigid& pose = poses_[static_cast<std::size_t>(structure_.groups[g].pose)];
      const Vector3d point_rig = pose.R * point + pose.t;
      for (std::size_t k = structure_.groups[g].first_term; k < structure_.groups[g + 1].first_term; ++k) {
        const BundleStructure::Term& term = structure_.terms[k];
        const auto error =
            residual_error(state.rig.models[static_cast<std::size_t>(term.camera)],
                           in_camera(structure_.groups[g].pose, term, point_rig), term.pixel.cast<double>());
        sum += kernel_cost(
            kernel_, error ? (term.inverse_sigma * *error).squaredNorm() : std::numeric_limits<double>::infinity());
      }
    }
  }
  return 0.5 * sum + rig_.prior_cost(state.rig);
}

BundleEquations::GroupSums BundleEquations::sum_group(std::size_t group, const Rigid& pose, const Vector3d& point_rig) {
  GroupSums out;
  const int slot = structure_.groups[group].slot;
  const RigTerms::Point point{point_rig, pose.R, slot < 0 ? -1 : system_.frames().offset(slot)};
  for (std::size_t k = structure_.groups[group].first_term; k < structure_.groups[group + 1].first_term; ++k) {
    const BundleStructure::Term& term = structure_.terms[k];
    const Rigid& T = cam_from_rig(structure_.groups[group].pose, term.camera);
    const Vector3d p = in_camera(structure_.groups[group].pose, term, point_rig);
    const auto camera = static_cast<std::size_t>(term.camera);
    const auto r = residual(state_.rig.models[camera], p, term.pixel.cast<double>());
    Vector2d e = Vector2d::Zero();
    double chi2 = kMaxChi2;
    if (r) {
      e = term.inverse_sigma * r->error;
      chi2 = e.squaredNorm();
    }
    out.cost += kernel_cost(kernel_, chi2);
    if (!(chi2 < kMaxChi2)) continue;
    const double weight = kernel_weight(kernel_, chi2);
    const Matrix23d J = term.inverse_sigma * r->J;
    const Matrix23d A = at_capture(J, structure_.groups[group].pose, term) * T.R;
    const Matrix23d wA = weight * A;
    out.M.noalias() += A.transpose() * wA;
    out.m.noalias() += wA.transpose() * e;
    if (rig_.size() == 0) continue;
    const RowMotion row = row_motion(structure_.groups[group].pose, term, p);
    rig_.add({term.camera, state_.rig, p, J, row.velocity, row.relative_row, term.inverse_sigma}, A, e, weight, point);
  }
  return out;
}

// With G = [-[P']x  I]: H += G^T M G, b += G^T m, W = G^T M R. Rotation first.
void BundleEquations::add_to_pose(const GroupSums& sums, const Vector3d& point_rig, const Matrix3d& R_rig_world,
                                  PoseBlock& pose, Matrix63d& W) const {
  const Matrix3d P = geometry::skew(point_rig);
  const Matrix3d PM = P * sums.M;
  pose.H.topLeftCorner<3, 3>().noalias() -= PM * P;
  pose.H.bottomLeftCorner<3, 3>() += PM.transpose();  // the upper triangle is not stored
  pose.H.bottomRightCorner<3, 3>() += sums.M;
  pose.b.head<3>() += point_rig.cross(sums.m);
  pose.b.tail<3>() += sums.m;
  W.topRows<3>().noalias() = PM * R_rig_world;
  W.bottomRows<3>().noalias() = sums.M * R_rig_world;
}

// Adds the costs of the point's observations to `sum`.
void BundleEquations::linearise_point(std::size_t i, double& sum) {
  const Vector3d& point = state_.points[static_cast<std::size_t>(structure_.points[i].point)];
  PointBlock block{Matrix3d::Zero(), Vector3d::Zero()};
  std::size_t next_W = first_W_[i];
  for (std::size_t g = structure_.points[i].first_group; g < structure_.points[i + 1].first_group; ++g) {
    const BundleStructure::Group& group = structure_.groups[g];
    const Rigid& pose = poses_[static_cast<std::size_t>(group.pose)];
    const Vector3d point_rig = pose.R * point + pose.t;
    const GroupSums sums = sum_group(g, pose, point_rig);
    sum += sums.cost;
    block.b.noalias() += pose.R.transpose() * sums.m;
    if (group.slot < 0) {
      const Matrix3d MR = sums.M * pose.R;
      block.V.noalias() += pose.R.transpose() * MR;
    } else {
      Matrix63d& W = W_[next_W++];
      add_to_pose(sums, point_rig, pose.R, pose_blocks_[static_cast<std::size_t>(group.slot)], W);
      block.V.noalias() += pose.R.transpose() * W.bottomRows<3>();
    }
  }
  point_blocks_[i] = block;
}

double BundleEquations::linearise() {
  set_poses(state_);
  for (PoseBlock& block : pose_blocks_) {
    block.H.setZero();
    block.b.setZero();
  }
  if (rig_.size() > 0) rig_.begin(state_.rig);
  double sum = 0.0;
  for (std::size_t i = 0; i < structure_.num_points(); ++i) {
    if (rig_.size() > 0) rig_.begin_point(i);
    linearise_point(i, sum);
  }
  return 0.5 * sum + rig_.prior_cost(state_.rig);
}

// Eliminates the point from the reduced system: S_ab -= U_a U_b^T, r_a -= U_a (L^-1 b), U = W L^-T.
void BundleEquations::eliminate_point(std::size_t point, double damping) {
  const Matrix3d L = damped_cholesky(point_blocks_[point].V, damping);
  L_[point] = L;
  const double i0 = 1.0 / L(0, 0), i1 = 1.0 / L(1, 1), i2 = 1.0 / L(2, 2);
  Vector3d y = point_blocks_[point].b;
  L.triangularView<Eigen::Lower>().solveInPlace(y);
  const int* block = structure_.pair_block.data() + structure_.points[point].first_pair;
  const std::size_t first = first_W_[point], count = first_W_[point + 1] - first;
  std::size_t a = 0;
  for (std::size_t g = structure_.points[point].first_group; a < count; ++g) {
    const int slot = structure_.groups[g].slot;
    if (slot < 0) continue;
    const Matrix63d& W = W_[first + a];
    Matrix63d& U = U_[a].U;
    U.col(0) = W.col(0) * i0;
    U.col(1) = (W.col(1) - L(1, 0) * U.col(0)) * i1;
    U.col(2) = (W.col(2) - L(2, 0) * U.col(0) - L(2, 1) * U.col(1)) * i2;
    U_[a].pose_offset = system_.frames().offset(slot);
    system_.rhs().segment<6>(U_[a].pose_offset).noalias() -= U * y;
    for (std::size_t b = 0; b <= a; ++b) {
      auto S = system_.frames().leading<6>(*block++);
      if (S.outerStride() == 6) {
        matrix::subtract_outer_product(U, U_[b].U, S.data());
      } else {
        S.noalias() -= U.lazyProduct(U_[b].U.transpose());
      }
    }
    ++a;
  }
  if (rig_.size() > 0) rig_.eliminate(point, L, y, {U_.data(), count}, system_);
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
  for (std::size_t i = 0; i < structure_.num_points(); ++i) eliminate_point(i, damping);
  return system_;
}

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
  effect(sought, Eigen::all) = found;
  return rows_of(poses, effect);
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
  for (std::size_t i = 0; i < structure_.num_points(); ++i) {
    const Vector3d delta = point_update(i);
    const PointBlock& block = point_blocks_[i];
    gain += delta.dot(block.b);
    for (int k = 0; k < 3; ++k) gain += damping * bounded_diagonal(block.V(k, k)) * delta(k) * delta(k);
    trial_.points[static_cast<std::size_t>(structure_.points[i].point)] += delta;
  }
  if (!std::isfinite(gain)) return std::nullopt;
  return 0.5 * gain;
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
