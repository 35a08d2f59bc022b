#include "calibration/joint_refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "base/assert.h"
#include "calibration/rig_bundle_adjustment.h"

namespace bslam::calibration {
namespace {

// Returns the rig whose difference from `calibrated` is `change` (RigInformation), with the timing of `timed`. The pose
// of camera 0 on the body stays as given, while that of a rig refined during a run is corrected for a change of its
// principal point (rig_frame.h), since here there are no poses that have to stay comparable.
camera::Rig changed(const camera::Rig& calibrated, const Eigen::VectorXd& change, const camera::Rig& timed) {
  solver::RigValues values = solver::RigValues::of(calibrated.in_frame_of_camera_0());
  for (std::size_t c = 0; c < calibrated.size(); ++c) {
    const TimeNs shift_ns = timed.camera(c).time_offset_ns - calibrated.camera(c).time_offset_ns;
    values.timing[c] = {to_seconds(shift_ns), timed.camera(c).readout_s};
  }
  Eigen::Index at = 0;
  for (std::size_t c = 1; c < calibrated.size(); ++c, at += 6) {
    const geometry::SE3 D(geometry::so3_exp(change.segment<3>(at)), change.segment<3>(at + 3));
    values.T_cam_rig[c] = D * values.T_cam_rig[c];
  }
  for (camera::CameraModel& model : values.models) {
    const camera::ModelParameters before = camera::parameters(model);
    model = camera::with_parameters(model, before + change.segment(at, before.size()));
    at += before.size();
  }
  return values.applied_to(calibrated);
}

// Returns the diagonal of the inverse; nullopt if the matrix is singular.
std::optional<Eigen::VectorXd> variances(const Eigen::MatrixXd& information) {
  const Eigen::LLT<Eigen::MatrixXd> factor(information);
  if (factor.info() != Eigen::Success) return std::nullopt;
  return factor.solve(Eigen::MatrixXd::Identity(information.rows(), information.cols())).diagonal();
}

std::vector<CalibratedCamera> by_camera(const camera::Rig& calibrated, const Eigen::VectorXd& change,
                                        const Eigen::VectorXd& variance, const Eigen::VectorXd& prior_variance) {
  std::vector<CalibratedCamera> out(calibrated.size());
  for (CalibratedValue& value : out.front().extrinsics) value.observed = true;
  Eigen::Index at = 0;
  const auto next = [&] {
    const double std = std::sqrt(variance(at));
    const CalibratedValue value{change(at), std, std < kObservedRatio * std::sqrt(prior_variance(at))};
    ++at;
    return value;
  };
  for (std::size_t c = 1; c < calibrated.size(); ++c) {
    for (CalibratedValue& value : out[c].extrinsics) value = next();
  }
  for (std::size_t c = 0; c < calibrated.size(); ++c) {
    const auto parameters = camera::parameters(calibrated.camera(c).model).size();
    for (Eigen::Index k = 0; k < parameters; ++k) out[c].intrinsics.push_back(next());
  }
  return out;
}

// The prior of a camera is wider if it was taken as displaced, and it is displaced in all recordings if it is in one.
const Eigen::MatrixXd& widest_prior(std::span<const RigRefinement> refinements) {
  const auto trace = [](const RigRefinement& r) { return r.information.prior.trace(); };
  return std::ranges::min_element(refinements, {}, trace)->information.prior;
}

}  // namespace

std::optional<JointRefinement> combine(const camera::Rig& calibrated, std::span<const RigRefinement> refinements) {
  BSLAM_ASSERT(!refinements.empty(), "there must be an estimate");
  const Eigen::MatrixXd& prior = widest_prior(refinements);
  Eigen::MatrixXd information = prior;
  Eigen::VectorXd weighted = Eigen::VectorXd::Zero(prior.rows());
  for (const RigRefinement& r : refinements) {
    information += r.information.information - r.information.prior;
    weighted += r.information.information * r.information.change;  // of the images alone: the mean of the prior is zero
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(information);
  const auto variance = variances(information), prior_variance = variances(prior);
  if (factor.info() != Eigen::Success || !variance || !prior_variance) return std::nullopt;
  const Eigen::VectorXd change = factor.solve(weighted);
  return JointRefinement{changed(calibrated, change, refinements.back().rig.value_or(calibrated)),
                         by_camera(calibrated, change, *variance, *prior_variance),
                         {change, information, prior}};
}

}  // namespace bslam::calibration
