#include "solver/bundle_equations.h"

#include <algorithm>
#include <cmath>
#include <variant>

namespace bslam::solver {
namespace {

// Bounds of the diagonal that damping scales: a direction without information still gets some damping.
constexpr double kMinDiagonal = 1e-6, kMaxDiagonal = 1e32;

double scale_of(double diagonal) { return std::clamp(diagonal, kMinDiagonal, kMaxDiagonal); }

// L with L L^T = V + damping * diag(V).
geometry::Matrix3d damped_cholesky(const geometry::Matrix3d& V, double damping) {
  geometry::Matrix3d L = geometry::Matrix3d::Zero();
  const double v00 = V(0, 0) + damping * scale_of(V(0, 0));
  const double v11 = V(1, 1) + damping * scale_of(V(1, 1));
  const double v22 = V(2, 2) + damping * scale_of(V(2, 2));
  L(0, 0) = std::sqrt(v00);
  L(1, 0) = V(1, 0) / L(0, 0);
  L(2, 0) = V(2, 0) / L(0, 0);
  L(1, 1) = std::sqrt(v11 - L(1, 0) * L(1, 0));
  L(2, 1) = (V(2, 1) - L(2, 0) * L(1, 0)) / L(1, 1);
  L(2, 2) = std::sqrt(v22 - L(2, 0) * L(2, 0) - L(2, 1) * L(2, 1));
  return L;
}

}  // namespace

BundleEquations::BundleEquations(const ReprojectionProblem& problem, const BundleStructure& structure, Kernel kernel,
                                 int dense_poses)
    : structure_(structure),
      kernel_(kernel),
      pose_blocks_(structure.pose_of_slot.size()),
      point_blocks_(structure.num_points()),
      L_(structure.num_points()),
      system_(structure.pattern, structure.pattern.size() <= dense_poses ? ReducedCameraSystem::Storage::kDense
                                                                         : ReducedCameraSystem::Storage::kSparse) {
  const Rig& rig = *problem.rig;
  for (std::size_t i = 0; i < rig.size(); ++i) models_.push_back(&rig.camera(i).model);
  cam_from_rig_.reserve(problem.T_rig_world.size() * rig.size());
  for (std::size_t pose = 0; pose < problem.T_rig_world.size(); ++pose) {
    for (std::size_t i = 0; i < rig.size(); ++i) {
      const SE3 T = cam_from_rig_at(problem, pose, CameraIndex(i));
      cam_from_rig_.push_back({T.matrix3(), T.translation()});
    }
  }
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

void BundleEquations::set_poses(const std::vector<SE3>& T_rig_world) {
  poses_.resize(T_rig_world.size());
  for (std::size_t i = 0; i < poses_.size(); ++i) poses_[i] = {T_rig_world[i].matrix3(), T_rig_world[i].translation()};
}

double BundleEquations::cost(const BundleState& state) {
  set_poses(state.T_rig_world);
  double sum = 0.0;
  for (std::size_t i = 0; i < structure_.num_points(); ++i) {
    const Vector3d& point = state.points[static_cast<std::size_t>(structure_.points[i].point)];
    for (std::size_t g = structure_.points[i].first_group; g < structure_.points[i + 1].first_group; ++g) {
      const Rigid& pose = poses_[static_cast<std::size_t>(structure_.groups[g].pose)];
      const Vector3d point_rig = pose.R * point + pose.t;
      for (std::size_t k = structure_.groups[g].first_term; k < structure_.groups[g + 1].first_term; ++k) {
        const BundleStructure::Term& term = structure_.terms[k];
        const Rigid& T = cam_from_rig(structure_.groups[g].pose, term.camera);
        const Vector3d p = T.R * point_rig + T.t;
        const auto pixel = std::visit([&](const auto& model) { return model.project(p); },
                                      *models_[static_cast<std::size_t>(term.camera)]);
        double chi2 = kLostChi2;
        if (pixel) chi2 = (term.inverse_sigma * (term.pixel.cast<double>() - *pixel)).squaredNorm();
        sum += kernel_cost(kernel_, chi2 < kLostChi2 ? chi2 : kLostChi2);
      }
    }
  }
  return 0.5 * sum;
}

BundleEquations::GroupSums BundleEquations::sum_group(std::size_t group, const Vector3d& point_rig) const {
  GroupSums out;
  for (std::size_t k = structure_.groups[group].first_term; k < structure_.groups[group + 1].first_term; ++k) {
    const BundleStructure::Term& term = structure_.terms[k];
    const Rigid& T = cam_from_rig(structure_.groups[group].pose, term.camera);
    const Vector3d p = T.R * point_rig + T.t;
    const auto projection = std::visit([&](const auto& model) { return model.project_with_jacobian(p); },
                                       *models_[static_cast<std::size_t>(term.camera)]);
    Vector2d e = Vector2d::Zero();
    double chi2 = kLostChi2;
    if (projection) {
      e = term.inverse_sigma * (term.pixel.cast<double>() - projection->pixel);
      chi2 = e.squaredNorm();
    }
    if (!(chi2 < kLostChi2)) {
      out.cost += kernel_cost(kernel_, kLostChi2);
      continue;
    }
    out.cost += kernel_cost(kernel_, chi2);
    const double weight = kernel_weight(kernel_, chi2);
    const Matrix23d A = (term.inverse_sigma * projection->jacobian) * T.R;
    const Matrix23d wA = weight * A;
    out.M.noalias() += A.transpose() * wA;
    out.m.noalias() += wA.transpose() * e;
  }
  return out;
}

// With G = [-[P']x  I]: H += G^T M G, b += G^T m, W = G^T M R. Rotation first.
void BundleEquations::add_to_pose(const GroupSums& sums, const Vector3d& point_rig, const Matrix3d& R_rig_world,
                                  PoseBlock& pose, Matrix63d& W) const {
  const Matrix3d P = geometry::skew(point_rig);
  const Matrix3d PM = P * sums.M;
  pose.H.topLeftCorner<3, 3>().noalias() -= PM * P;
  pose.H.bottomLeftCorner<3, 3>() += PM.transpose();  // the upper triangle is not kept
  pose.H.bottomRightCorner<3, 3>() += sums.M;
  pose.b.head<3>() += point_rig.cross(sums.m);
  pose.b.tail<3>() += sums.m;
  W.topRows<3>().noalias() = PM * R_rig_world;
  W.bottomRows<3>().noalias() = sums.M * R_rig_world;
}

double BundleEquations::linearise(const BundleState& state) {
  set_poses(state.T_rig_world);
  for (PoseBlock& block : pose_blocks_) {
    block.H.setZero();
    block.b.setZero();
  }
  double sum = 0.0;
  std::size_t next_W = 0;
  for (std::size_t i = 0; i < structure_.num_points(); ++i) {
    const Vector3d& point = state.points[static_cast<std::size_t>(structure_.points[i].point)];
    PointBlock block{Matrix3d::Zero(), Vector3d::Zero()};
    for (std::size_t g = structure_.points[i].first_group; g < structure_.points[i + 1].first_group; ++g) {
      const BundleStructure::Group& group = structure_.groups[g];
      const Rigid& pose = poses_[static_cast<std::size_t>(group.pose)];
      const Vector3d point_rig = pose.R * point + pose.t;
      const GroupSums sums = sum_group(g, point_rig);
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
  return 0.5 * sum;
}

// Subtracts what the point says from the reduced system: S_ab -= U_a U_b^T, r_a -= U_a (L^-1 b), U = W L^-T.
void BundleEquations::eliminate_point(std::size_t point, double damping) {
  const Matrix3d L = damped_cholesky(point_blocks_[point].V, damping);
  L_[point] = L;
  const double i0 = 1.0 / L(0, 0), i1 = 1.0 / L(1, 1), i2 = 1.0 / L(2, 2);
  const Vector3d y = L.triangularView<Eigen::Lower>().solve(point_blocks_[point].b);
  const int* block = structure_.pair_block.data() + structure_.points[point].first_pair;
  const std::size_t first = first_W_[point], count = first_W_[point + 1] - first;
  std::size_t a = 0;
  for (std::size_t g = structure_.points[point].first_group; a < count; ++g) {
    const int slot = structure_.groups[g].slot;
    if (slot < 0) continue;
    const Matrix63d& W = W_[first + a];
    Matrix63d& U = U_[a];
    U.col(0) = W.col(0) * i0;
    U.col(1) = (W.col(1) - L(1, 0) * U.col(0)) * i1;
    U.col(2) = (W.col(2) - L(2, 0) * U.col(0) - L(2, 1) * U.col(1)) * i2;
    system_.rhs().segment<6>(6 * slot).noalias() -= U * y;
    for (std::size_t b = 0; b <= a; ++b) {
      system_.blocks()[static_cast<std::size_t>(*block++)].noalias() -= U.lazyProduct(U_[b].transpose());
    }
    ++a;
  }
}

void BundleEquations::eliminate_points(double damping) {
  for (Matrix6d& block : system_.blocks()) block.setZero();
  for (std::size_t slot = 0; slot < pose_blocks_.size(); ++slot) {
    const int at = static_cast<int>(slot);
    Matrix6d& block = system_.blocks()[static_cast<std::size_t>(structure_.pattern.index(at, at))];
    block = pose_blocks_[slot].H;
    for (int k = 0; k < 6; ++k) block(k, k) += damping * scale_of(block(k, k));
    system_.rhs().segment<6>(6 * at) = pose_blocks_[slot].b;
  }
  for (std::size_t i = 0; i < structure_.num_points(); ++i) eliminate_point(i, damping);
}

// V delta_p = b - sum of W^T delta over the point's free poses.
Vector3d BundleEquations::point_update(std::size_t point) const {
  Vector3d rhs = point_blocks_[point].b;
  std::size_t next_W = first_W_[point];
  for (std::size_t g = structure_.points[point].first_group; next_W < first_W_[point + 1]; ++g) {
    const int slot = structure_.groups[g].slot;
    if (slot >= 0) rhs.noalias() -= W_[next_W++].transpose() * delta_.segment<6>(6 * slot);
  }
  L_[point].triangularView<Eigen::Lower>().solveInPlace(rhs);
  L_[point].transpose().triangularView<Eigen::Upper>().solveInPlace(rhs);
  return rhs;
}

bool BundleEquations::solve(double damping, const BundleState& from, BundleState& to, Step& step) {
  eliminate_points(damping);
  if (!system_.solve(delta_)) return false;
  to = from;
  double gain = 0.0, squared = delta_.squaredNorm();  // gain = delta^T (b + damping D delta)
  for (std::size_t slot = 0; slot < pose_blocks_.size(); ++slot) {
    const Vector6d delta = delta_.segment<6>(6 * static_cast<int>(slot));
    const PoseBlock& block = pose_blocks_[slot];
    gain += delta.dot(block.b);
    for (int k = 0; k < 6; ++k) gain += damping * scale_of(block.H(k, k)) * delta(k) * delta(k);
    SE3& T = to.T_rig_world[static_cast<std::size_t>(structure_.pose_of_slot[slot])];
    T = T.perturbed(delta);
  }
  for (std::size_t i = 0; i < structure_.num_points(); ++i) {
    const Vector3d delta = point_update(i);
    const PointBlock& block = point_blocks_[i];
    gain += delta.dot(block.b);
    for (int k = 0; k < 3; ++k) gain += damping * scale_of(block.V(k, k)) * delta(k) * delta(k);
    squared += delta.squaredNorm();
    to.points[static_cast<std::size_t>(structure_.points[i].point)] += delta;
  }
  step = {0.5 * gain, std::sqrt(squared)};
  return std::isfinite(gain) && std::isfinite(squared);
}

}  // namespace bslam::solver
