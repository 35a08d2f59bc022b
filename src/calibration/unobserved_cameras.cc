#include "calibration/unobserved_cameras.h"

#include <Eigen/Cholesky>

#include "calibration/rig_frame.h"

namespace bslam::calibration {
namespace {

// Replaces what an estimate tells about the extrinsics of camera c by what the prior tells if the others are known.
void forget_extrinsics(std::size_t c, RigInformation& estimate) {
  const auto at = static_cast<Eigen::Index>(6 * (c - 1));
  std::vector<Eigen::Index> own, others;
  for (Eigen::Index k = 0; k < estimate.change.size(); ++k) (k >= at && k < at + 6 ? own : others).push_back(k);
  const Eigen::MatrixXd coupling = estimate.information(others, own), of_own = estimate.information(own, own),
                        prior_coupling = estimate.prior(others, own), prior_of_own = estimate.prior(own, own);
  estimate.information(others, others) -= coupling * of_own.ldlt().solve(coupling.transpose());
  estimate.information(others, others) += prior_coupling * prior_of_own.ldlt().solve(prior_coupling.transpose());
  estimate.information(others, own) = prior_coupling;
  estimate.information(own, others) = prior_coupling.transpose();
  estimate.information(own, own) = prior_of_own;
  estimate.change(own) = -prior_of_own.ldlt().solve(prior_coupling.transpose() * estimate.change(others));
}

}  // namespace

geometry::SE3 unobserved_extrinsics(const camera::Rig& given, std::size_t c, const camera::CameraModel& estimated) {
  camera::Camera camera_0 = given.camera(0);
  camera_0.model = estimated;
  return given.cam_from_rig(c) * turn_of_rays(camera_0, given.camera(0)).inverse();
}

void complete_unobserved_cameras(const camera::Rig& given, RigAdjustment& adjusted) {
  solver::RigValues& values = adjusted.values;
  const Eigen::LLT<Eigen::MatrixXd> prior(adjusted.information.prior);
  for (std::size_t c = 1; c < given.size(); ++c) {
    CameraEstimate& camera = adjusted.cameras[c];
    if (camera.observations >= kMinCameraObservations) continue;
    values.T_cam_rig[c] = unobserved_extrinsics(given, c, values.models[0]);
    forget_extrinsics(c, adjusted.information);
    const auto at = static_cast<Eigen::Index>(6 * (c - 1)), n = adjusted.information.prior.rows();
    camera.change = solver::extrinsic_change(values.T_cam_rig[c], given.cam_from_rig(c));
    if (prior.info() == Eigen::Success)
      camera.covariance = prior.solve(Eigen::MatrixXd::Identity(n, n)).block<6, 6>(at, at);
    camera.observed = {};
    camera.unobserved_shift = camera.change.tail<3>().norm();
  }
}

}  // namespace bslam::calibration
