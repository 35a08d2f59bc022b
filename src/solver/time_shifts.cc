#include "solver/time_shifts.h"

#include <Eigen/Cholesky>

#include "solver/pose_problem.h"

namespace bslam::solver {
namespace {

using geometry::Vector6d;

// The normal equations of a perturbation of T_rig_world, from the observations of one camera.
PoseEquations equations_of(const Rig& rig, std::span<const PoseObservation> observations, const SE3& T_rig_world) {
  PoseProblem problem(rig, observations);
  problem.select(T_rig_world, kMaxChi2);
  return problem.linearise(T_rig_world, Kernel::kHuber);
}

}  // namespace

ShiftStep time_shift_step(const Rig& rig, std::span<const PoseObservation> observations, const SE3& T_rig_world,
                          const Vector6d& twist, const ShiftPrior& prior, bool pose_free) {
  const auto cameras = static_cast<Eigen::Index>(rig.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(6 + cameras, 6 + cameras);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(6 + cameras);
  b.tail(cameras) = prior.information.cwiseProduct(prior.mean_s);
  H.diagonal().tail(cameras) = prior.information;
  std::size_t begin = 0, end = 0;
  for (Eigen::Index c = 0; c < cameras; ++c, begin = end) {
    while (end < observations.size() && observations[end].camera.index() == static_cast<std::size_t>(c)) ++end;
    // A shift by s moves the camera as the perturbation s * twist of the rig does.
    const PoseEquations own = equations_of(rig, observations.subspan(begin, end - begin), T_rig_world);
    const Vector6d coupling = own.H * twist;
    H(6 + c, 6 + c) += twist.dot(coupling);
    b(6 + c) += twist.dot(own.b);
    if (!pose_free) continue;
    H.topLeftCorner<6, 6>() += own.H;
    b.head<6>() += own.b;
    H.block<6, 1>(0, 6 + c) = coupling;
    H.block<1, 6>(6 + c, 0) = coupling.transpose();
  }
  if (!pose_free) H.topLeftCorner<6, 6>().setIdentity();
  const Eigen::LDLT<Eigen::MatrixXd> factor(H);
  const Eigen::VectorXd x = factor.solve(b);
  const Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(6 + cameras, 6 + cameras));
  return {x.head<6>(), x.tail(cameras), covariance.diagonal().tail(cameras)};
}

}  // namespace bslam::solver
