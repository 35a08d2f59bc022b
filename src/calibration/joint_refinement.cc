#include "calibration/joint_refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "base/assert.h"
#include "calibration/rig_bundle_adjustment.h"
#include "calibration/unobserved_cameras.h"

namespace bslam::calibration {
namespace {

// The mean of values from several recordings, weighted by the inverses of their variances.
class WeightedMean {
 public:
  void add(double value, double std) {
    const double weight = 1 / (std * std);
    if (sum_ == 0) first_ = value;
    sum_ += weight;
    sum_of_differences_ += weight * (value - first_);
  }
  // Returns `otherwise` if there are no values.
  double value_or(double otherwise) const { return sum_ > 0 ? first_ + sum_of_differences_ / sum_ : otherwise; }

 private:
  double first_ = 0, sum_ = 0, sum_of_differences_ = 0;
};

// The timing of a camera relative to the capture times of `calibrated`, from the recordings that show it; as in the
// last one if none does.
camera::CameraTiming timing_of(const camera::Rig& calibrated, std::span<const RigRefinement> refinements,
                               std::size_t c) {
  camera::CameraTiming out{0, calibrated.camera(c).readout_s};
  WeightedMean shift_s, readout_s;
  for (const RigRefinement& r : refinements) {
    if (!r.rig || r.cameras.empty()) continue;
    out = {to_seconds(r.rig->camera(c).time_offset_ns - calibrated.camera(c).time_offset_ns),
           r.rig->camera(c).readout_s};
    const TimeRefinement &offset = r.cameras[c].time_offset, &readout = r.cameras[c].readout;
    if (offset.refined) shift_s.add(out.shift_s, offset.std_ms);
    if (readout.refined) readout_s.add(out.readout_s, readout.std_ms);
  }
  return {shift_s.value_or(out.shift_s), readout_s.value_or(out.readout_s)};
}

// Returns the rig whose difference from `calibrated` is `change` (RigInformation). The pose of camera 0 on the body
// stays as given, while that of a rig refined during a run is corrected for a change of its principal point
// (rig_frame.h), since here there are no poses that have to stay comparable.
camera::Rig changed(const camera::Rig& calibrated, const Eigen::VectorXd& change,
                    std::span<const RigRefinement> refinements) {
  solver::RigValues values = solver::RigValues::of(calibrated.in_frame_of_camera_0());
  for (std::size_t c = 0; c < calibrated.size(); ++c) values.timing[c] = timing_of(calibrated, refinements, c);
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

// Gives the cameras that no recording shows the extrinsics that belong to the estimated intrinsics of camera 0.
void complete_unobserved(const camera::Rig& calibrated, std::span<const RigRefinement> refinements,
                         Eigen::VectorXd& change) {
  const camera::Rig given = calibrated.in_frame_of_camera_0();
  const camera::CameraModel& model = given.camera(0).model;
  const camera::ModelParameters before = camera::parameters(model);
  const auto of_camera_0 = static_cast<Eigen::Index>(6 * (given.size() - 1));
  const camera::CameraModel estimated =
      camera::with_parameters(model, before + change.segment(of_camera_0, before.size()));
  for (std::size_t c = 1; c < given.size(); ++c) {
    const auto shown_by = [c](const RigRefinement& r) {
      return r.cameras.empty() || r.cameras[c].observations >= kMinCameraObservations;
    };
    if (std::ranges::any_of(refinements, shown_by)) continue;
    change.segment<6>(static_cast<Eigen::Index>(6 * (c - 1))) =
        solver::extrinsic_change(unobserved_extrinsics(given, c, estimated), given.cam_from_rig(c));
  }
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
  Eigen::VectorXd change = factor.solve(weighted);
  complete_unobserved(calibrated, refinements, change);
  return JointRefinement{changed(calibrated, change, refinements),
                         by_camera(calibrated, change, *variance, *prior_variance),
                         {change, information, prior}};
}

}  // namespace bslam::calibration
