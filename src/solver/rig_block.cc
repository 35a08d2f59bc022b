#include "solver/rig_block.h"

namespace bslam::solver {
namespace {

using geometry::Matrix6d;
using geometry::Vector6d;

Vector6d information_of(const ExtrinsicPrior& prior) {
  const double rotation = 1.0 / (prior.sigma_rotation * prior.sigma_rotation);
  const double translation = 1.0 / (prior.sigma_translation * prior.sigma_translation);
  return (Vector6d() << rotation, rotation, rotation, translation, translation, translation).finished();
}

// d extrinsic_change / d(left perturbation): exp(w) R has the logarithm phi + J_l^-1 w, its translation is t + w x t +
// v.
Matrix6d change_jacobian(const Vector6d& change) {
  Matrix6d J = Matrix6d::Identity();
  J.topLeftCorner<3, 3>() = geometry::so3_left_jacobian_inverse(change.head<3>());
  J.bottomLeftCorner<3, 3>() = -geometry::skew(change.tail<3>());
  return J;
}

}  // namespace

Vector6d extrinsic_change(const SE3& T_cam_rig, const SE3& reference) {
  const SE3 D = T_cam_rig * reference.inverse();
  return (Vector6d() << geometry::so3_log(D.rotation()), D.translation()).finished();
}

void ExtrinsicsBlock::evaluate(const RigObservation& observation, Eigen::Ref<Jacobian> J) const {
  J = pose_jacobian_transposed(observation.J, observation.point_cam).transpose();
}

void ExtrinsicsBlock::apply(const Eigen::VectorXd& delta, RigValues& values) const {
  for (std::size_t c = 1; c < values.T_cam_rig.size(); ++c) {
    const Vector6d step = delta.segment<6>(6 * (static_cast<Eigen::Index>(c) - 1));
    values.T_cam_rig[c] = values.T_cam_rig[c].perturbed(step);
  }
}

double ExtrinsicsBlock::prior_cost(const RigValues& values) const {
  const Vector6d information = information_of(prior_);
  double sum = 0.0;
  for (std::size_t c = 1; c < values.T_cam_rig.size(); ++c) {
    sum += extrinsic_change(values.T_cam_rig[c], prior_.T_cam_rig[c]).cwiseAbs2().dot(information);
  }
  return 0.5 * sum;
}

void ExtrinsicsBlock::add_prior(const RigValues& values, Eigen::Ref<Eigen::MatrixXd> H,
                                Eigen::Ref<Eigen::VectorXd> b) const {
  const Vector6d information = information_of(prior_);
  for (std::size_t c = 1; c < values.T_cam_rig.size(); ++c) {
    const Vector6d change = extrinsic_change(values.T_cam_rig[c], prior_.T_cam_rig[c]);
    const Matrix6d J = change_jacobian(change);
    const Matrix6d JtI = J.transpose() * information.asDiagonal();
    const auto at = 6 * (static_cast<Eigen::Index>(c) - 1);
    H.block<6, 6>(at, at) += JtI * J;
    b.segment<6>(at) -= JtI * change;
  }
}

void BaselineScaleBlock::evaluate(const RigObservation& observation, Eigen::Ref<Jacobian> J) const {
  J = observation.J * observation.T_cam_rig.translation();
}

void BaselineScaleBlock::apply(const Eigen::VectorXd& delta, RigValues& values) const {
  for (SE3& T : values.T_cam_rig) T = geometry::scaled(T, 1.0 + delta(0));
}

}  // namespace bslam::solver
