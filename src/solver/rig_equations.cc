#include "solver/rig_equations.h"

#include <algorithm>
#include <cmath>

namespace bslam::solver {
namespace {

using geometry::Matrix3d;
using geometry::Matrix6d;
using geometry::Vector6d;

// Bounds of the diagonal that damping scales: a direction without information still gets some damping.
constexpr double kMinDiagonal = 1e-6, kMaxDiagonal = 1e32;
// Damping of the information: large enough to factorise points without parallax. It must be this small: to scale all lengths
// is held by the prior alone, a few units of information, and moves every point, each of which damping resists.
constexpr double kInformationDamping = 1e-13;

template <class Diagonal>
auto damping_of(const Diagonal& diagonal, double damping) {
  return (damping * diagonal.array().max(kMinDiagonal).min(kMaxDiagonal)).matrix().eval();
}

Eigen::LLT<Matrix3d> damped_factor(const Matrix3d& V, double damping) {
  Matrix3d damped = V;
  damped.diagonal() += damping_of(V.diagonal(), damping);
  return Eigen::LLT<Matrix3d>(damped);
}

Vector6d information_of(const ExtrinsicPrior& prior) {
  const double rotation = 1.0 / (prior.sigma_rotation * prior.sigma_rotation);
  const double translation = 1.0 / (prior.sigma_translation * prior.sigma_translation);
  return (Vector6d() << rotation, rotation, rotation, translation, translation, translation).finished();
}

// d extrinsic_change / d(left perturbation): exp(w) R has the logarithm phi + J_l^-1 w, its translation is t + w x t + v.
Matrix6d change_jacobian(const Vector6d& change) {
  Matrix6d J = Matrix6d::Identity();
  J.topLeftCorner<3, 3>() = geometry::so3_left_jacobian_inverse(change.head<3>());
  J.bottomLeftCorner<3, 3>() = -geometry::skew(change.tail<3>());
  return J;
}

}  // namespace

std::optional<RigResidual> RigResidual::evaluate(const camera::Camera& camera, const SE3& T_cam_rig, const SE3& motion,
                                                 const SE3& T_rig_world, const Vector3d& point_world, const Vector2d& pixel) {
  const Vector3d point_rig = T_rig_world * point_world;
  const Vector3d point_cam = T_cam_rig * (motion * point_rig);
  const auto projection = camera.project_with_jacobian(point_cam);
  if (!projection) return std::nullopt;
  const Matrix23d J_rig = -projection->jacobian * (T_cam_rig.rotation() * motion.rotation()).toRotationMatrix();
  RigResidual out;
  out.error = pixel - projection->pixel;
  out.J_pose << -J_rig * geometry::skew(point_rig), J_rig;
  out.J_extrinsics << projection->jacobian * geometry::skew(point_cam), -projection->jacobian;
  out.J_point = J_rig * T_rig_world.matrix3();
  return out;
}

Vector6d extrinsic_change(const SE3& T_cam_rig, const SE3& reference) {
  const SE3 D = T_cam_rig * reference.inverse();
  return (Vector6d() << geometry::so3_log(D.rotation()), D.translation()).finished();
}

RigEquations::RigEquations(const ReprojectionProblem& problem, const BundleStructure& structure, Kernel kernel,
                           const ExtrinsicPrior& prior)
    : problem_(problem), structure_(structure), kernel_(kernel), prior_(prior), points_(structure.num_points()) {
  couple();
  const int unknowns = 6 * (num_poses() + static_cast<int>(problem.rig->size()) - 1);
  H_.resize(unknowns, unknowns);
  b_.resize(unknowns);
}

// Lays out which blocks each point couples to.
void RigEquations::couple() {
  of_camera_.assign(problem_.rig->size(), nullptr);
  std::size_t most = 0;
  for (std::size_t i = 0; i < structure_.num_points(); ++i) {
    first_coupling_.push_back(couplings_.size());
    std::vector<std::uint8_t> sees(problem_.rig->size(), 0);
    const std::size_t begin = structure_.points[i].first_group, end = structure_.points[i + 1].first_group;
    for (std::size_t g = begin; g < end; ++g) {
      if (structure_.groups[g].slot >= 0) couplings_.push_back({.block = structure_.groups[g].slot});
    }
    for (std::size_t k = structure_.groups[begin].first_term; k < structure_.groups[end].first_term; ++k) {
      sees[static_cast<std::size_t>(structure_.terms[k].camera)] = 1;
    }
    for (std::size_t c = 1; c < sees.size(); ++c) {
      if (sees[c] != 0) couplings_.push_back({.block = camera_block(static_cast<int>(c))});
    }
    most = std::max(most, couplings_.size() - first_coupling_.back());
  }
  first_coupling_.push_back(couplings_.size());
  U_.resize(most);
}

const SE3& RigEquations::motion(int pose, int camera) const {
  static const SE3 kStill;
  if (problem_.motion.empty()) return kStill;
  return problem_.motion[static_cast<std::size_t>(pose) * problem_.rig->size() + static_cast<std::size_t>(camera)];
}

double RigEquations::prior_cost(const RigState& state) const {
  const Vector6d information = information_of(prior_);
  double sum = 0.0;
  for (std::size_t c = 1; c < state.T_cam_rig.size(); ++c) {
    sum += extrinsic_change(state.T_cam_rig[c], prior_.T_cam_rig[c]).cwiseAbs2().dot(information);
  }
  return 0.5 * sum;
}

double RigEquations::cost(const RigState& state) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < structure_.num_points(); ++i) {
    const Vector3d& point = state.points[static_cast<std::size_t>(structure_.points[i].point)];
    for (std::size_t g = structure_.points[i].first_group; g < structure_.points[i + 1].first_group; ++g) {
      const int pose = structure_.groups[g].pose;
      const Vector3d point_rig = state.T_rig_world[static_cast<std::size_t>(pose)] * point;
      for (std::size_t k = structure_.groups[g].first_term; k < structure_.groups[g + 1].first_term; ++k) {
        const BundleStructure::Term& term = structure_.terms[k];
        const auto camera = static_cast<std::size_t>(term.camera);
        const auto pixel = problem_.rig->camera(camera).project(state.T_cam_rig[camera] * (motion(pose, term.camera) * point_rig));
        double chi2 = kLostChi2;
        if (pixel) chi2 = (static_cast<double>(term.inverse_sigma) * (term.pixel.cast<double>() - *pixel)).squaredNorm();
        sum += kernel_cost(kernel_, chi2 < kLostChi2 ? chi2 : kLostChi2);
      }
    }
  }
  return 0.5 * sum + prior_cost(state);
}

void RigEquations::add_term(const RigResidual& residual, double weight, int slot, int camera, std::size_t point,
                            Coupling* of_pose) {
  const Matrix23d wJ_point = weight * residual.J_point;
  points_[point].V.noalias() += residual.J_point.transpose() * wJ_point;
  points_[point].b.noalias() -= wJ_point.transpose() * residual.error;
  const int at_pose = 6 * slot, at_camera = 6 * camera_block(camera);
  if (slot >= 0) {
    const Matrix26d wJ = weight * residual.J_pose;
    H_.block<6, 6>(at_pose, at_pose).noalias() += residual.J_pose.transpose() * wJ;
    b_.segment<6>(at_pose).noalias() -= wJ.transpose() * residual.error;
    of_pose->W.noalias() += residual.J_pose.transpose() * wJ_point;
  }
  if (camera == 0) return;
  const Matrix26d wJ = weight * residual.J_extrinsics;
  H_.block<6, 6>(at_camera, at_camera).noalias() += residual.J_extrinsics.transpose() * wJ;
  b_.segment<6>(at_camera).noalias() -= wJ.transpose() * residual.error;
  of_camera_[static_cast<std::size_t>(camera)]->W.noalias() += residual.J_extrinsics.transpose() * wJ_point;
  if (slot >= 0) H_.block<6, 6>(at_camera, at_pose).noalias() += wJ.transpose() * residual.J_pose;
}

double RigEquations::linearise_point(std::size_t point, const RigState& state) {
  points_[point] = {};
  Coupling* of_pose = couplings_.data() + first_coupling_[point];
  for (std::size_t c = first_coupling_[point]; c < first_coupling_[point + 1]; ++c) {
    couplings_[c].W.setZero();
    const int camera = couplings_[c].block - num_poses() + 1;
    if (camera > 0) of_camera_[static_cast<std::size_t>(camera)] = &couplings_[c];
  }
  double sum = 0.0;
  const Vector3d& position = state.points[static_cast<std::size_t>(structure_.points[point].point)];
  for (std::size_t g = structure_.points[point].first_group; g < structure_.points[point + 1].first_group; ++g) {
    const BundleStructure::Group& group = structure_.groups[g];
    for (std::size_t k = group.first_term; k < structure_.groups[g + 1].first_term; ++k) {
      const BundleStructure::Term& term = structure_.terms[k];
      const auto camera = static_cast<std::size_t>(term.camera);
      const auto residual = RigResidual::evaluate(problem_.rig->camera(camera), state.T_cam_rig[camera],
                                                  motion(group.pose, term.camera),
                                                  state.T_rig_world[static_cast<std::size_t>(group.pose)], position,
                                                  term.pixel.cast<double>());
      const double information = static_cast<double>(term.inverse_sigma) * static_cast<double>(term.inverse_sigma);
      double chi2 = kLostChi2;
      if (residual) chi2 = information * residual->error.squaredNorm();
      if (!(chi2 < kLostChi2)) {
        sum += kernel_cost(kernel_, kLostChi2);
        continue;
      }
      sum += kernel_cost(kernel_, chi2);
      add_term(*residual, information * kernel_weight(kernel_, chi2), group.slot, term.camera, point, of_pose);
    }
    if (group.slot >= 0) ++of_pose;
  }
  return sum;
}

void RigEquations::add_prior(const RigState& state) {
  const Vector6d information = information_of(prior_);
  const auto size = static_cast<Eigen::Index>(6 * (state.T_cam_rig.size() - 1));
  prior_information_.setZero(size, size);
  for (std::size_t c = 1; c < state.T_cam_rig.size(); ++c) {
    const Vector6d change = extrinsic_change(state.T_cam_rig[c], prior_.T_cam_rig[c]);
    const Matrix6d J = change_jacobian(change);
    const Matrix6d JtI = J.transpose() * information.asDiagonal();
    const auto at = static_cast<Eigen::Index>(6 * (c - 1));
    prior_information_.block<6, 6>(at, at) = JtI * J;
    b_.segment<6>(6 * camera_block(static_cast<int>(c))) -= JtI * change;
  }
  H_.bottomRightCorner(size, size) += prior_information_;
}

double RigEquations::linearise(const RigState& state) {
  H_.setZero();
  b_.setZero();
  double sum = 0.0;
  for (std::size_t i = 0; i < structure_.num_points(); ++i) sum += linearise_point(i, state);
  add_prior(state);
  return 0.5 * sum + prior_cost(state);
}

// Subtracts what the point says from the reduced system: S_ab -= U_a U_b^T, r_a -= U_a (L^-1 b), U = W L^-T.
void RigEquations::eliminate(std::size_t point, double damping) {
  const Eigen::LLT<Matrix3d> factor = damped_factor(points_[point].V, damping);
  const Vector3d y = factor.matrixL().solve(points_[point].b);
  const Coupling* couplings = couplings_.data() + first_coupling_[point];
  const std::size_t count = first_coupling_[point + 1] - first_coupling_[point];
  for (std::size_t a = 0; a < count; ++a) {
    U_[a] = factor.matrixL().solve(couplings[a].W.transpose()).transpose();
    r_.segment<6>(6 * couplings[a].block).noalias() -= U_[a] * y;
    for (std::size_t b = 0; b <= a; ++b) {
      S_.block<6, 6>(6 * couplings[a].block, 6 * couplings[b].block).noalias() -= U_[a].lazyProduct(U_[b].transpose());
    }
  }
}

// Forms and factorises the reduced system; false where it is not positive definite.
bool RigEquations::reduce(double damping) {
  S_ = H_;
  S_.diagonal() += damping_of(H_.diagonal(), damping);
  r_ = b_;
  for (std::size_t i = 0; i < structure_.num_points(); ++i) eliminate(i, damping);
  factor_.compute(S_.selfadjointView<Eigen::Lower>());
  return factor_.info() == Eigen::Success && r_.allFinite();
}

// V delta_p = b - sum of W^T delta over what the point couples to.
Vector3d RigEquations::point_update(std::size_t point, double damping, const Eigen::VectorXd& delta) const {
  Vector3d rhs = points_[point].b;
  for (std::size_t c = first_coupling_[point]; c < first_coupling_[point + 1]; ++c) {
    rhs.noalias() -= couplings_[c].W.transpose() * delta.segment<6>(6 * couplings_[c].block);
  }
  return damped_factor(points_[point].V, damping).solve(rhs);
}

std::optional<RigEquations::Step> RigEquations::solve(double damping, const RigState& from) {
  if (!reduce(damping)) return std::nullopt;
  const Eigen::VectorXd delta = factor_.solve(r_);
  Step step{0.0, from};
  double gain = delta.dot(b_) + delta.cwiseAbs2().dot(damping_of(H_.diagonal(), damping));  // delta^T (b + damping D delta)
  for (int slot = 0; slot < num_poses(); ++slot) {
    SE3& T = step.to.T_rig_world[static_cast<std::size_t>(structure_.pose_of_slot[static_cast<std::size_t>(slot)])];
    T = T.perturbed(delta.segment<6>(6 * slot));
  }
  for (std::size_t c = 1; c < from.T_cam_rig.size(); ++c) {
    step.to.T_cam_rig[c] = from.T_cam_rig[c].perturbed(delta.segment<6>(6 * camera_block(static_cast<int>(c))));
  }
  for (std::size_t i = 0; i < structure_.num_points(); ++i) {
    const Vector3d move = point_update(i, damping, delta);
    gain += move.dot(points_[i].b) + move.cwiseAbs2().dot(damping_of(points_[i].V.diagonal(), damping));
    step.to.points[static_cast<std::size_t>(structure_.points[i].point)] += move;
  }
  step.predicted = 0.5 * gain;
  if (!std::isfinite(gain)) return std::nullopt;
  return step;
}

// The unknowns of cameras come last, so that the corner of the Cholesky factor is that of their marginal information.
std::optional<RigEquations::Information> RigEquations::extrinsic_information() {
  if (!reduce(kInformationDamping)) return std::nullopt;
  const Eigen::Index size = prior_information_.rows();
  const Eigen::MatrixXd L = Eigen::MatrixXd(factor_.matrixL()).bottomRightCorner(size, size);
  return Information{L * L.transpose() - prior_information_, prior_information_};
}

}  // namespace bslam::solver
