#include "solver/rig_block.h"

#include <algorithm>
#include <utility>

#include "base/median.h"

namespace bslam::solver {
namespace {

using geometry::Matrix6d;
using geometry::Vector6d;

constexpr double kWiderIfDisplaced = 10.0;
constexpr double kNoBaseline = 1e-6;  // metres; cameras at one position differ by rounding errors of their poses

// d extrinsic_change / d(left perturbation): exp(w) R has the logarithm phi + J_l^-1 w, its translation is t + w x t +
// v.
Matrix6d change_jacobian(const Vector6d& change) {
  Matrix6d J = Matrix6d::Identity();
  J.topLeftCorner<3, 3>() = geometry::so3_left_jacobian_inverse(change.head<3>());
  J.bottomLeftCorner<3, 3>() = -geometry::skew(change.tail<3>());
  return J;
}

std::size_t num_with_baseline(const ExtrinsicPrior& prior) {
  return prior.with_baseline > 0 ? prior.with_baseline : prior.T_cam_rig.size();
}

// A camera after a move counts as displaced even if too few baselines exist to see it.
bool is_displaced(const ExtrinsicPrior& prior, std::size_t camera) {
  return camera >= num_with_baseline(prior) || (!prior.displaced.empty() && prior.displaced[camera]);
}

// Adds the columns of the next camera, which has `size` unknowns, to those of the cameras before it.
void add_columns(const SharedUnknowns& shared, int size, std::vector<RigBlock::Range>& columns, int& total) {
  const std::size_t c = columns.size();
  if (!has_own_unknowns(shared, c)) {
    columns.push_back(columns[shared[c]]);
  } else {
    columns.push_back({total, size});
    total += size;
  }
}

}  // namespace

RigValues RigValues::of(const Rig& rig) {
  RigValues out;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    out.T_cam_rig.push_back(rig.cam_from_rig(i));
    out.models.push_back(rig.camera(i).model);
    out.timing.push_back({0.0, rig.camera(i).readout_s});
  }
  return out;
}

Rig RigValues::applied_to(const Rig& rig) const {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    camera::Camera camera = rig.camera(i);
    camera.model = models[i];
    camera.readout_s = timing[i].readout_s;
    camera.time_offset_ns += from_seconds(timing[i].shift_s);
    const SE3 T_body_cam = i == 0 ? rig.body_from_cam(0) : rig.body_from_cam(0) * T_cam_rig[i].inverse();
    cameras.push_back({std::move(camera), T_body_cam});
  }
  return Rig(std::move(cameras));
}

Matrix6d covariance_of(const ExtrinsicPrior& prior, std::size_t camera) {
  const Vector3d axis = Vector3d::UnitZ(), axis_of_camera_0 = prior.T_cam_rig[camera].rotation() * Vector3d::UnitZ();
  const double sigma_translation = (is_displaced(prior, camera) ? kWiderIfDisplaced : 1.0) * prior.sigma_translation;
  Matrix6d out = Matrix6d::Zero();
  out.topLeftCorner<3, 3>().diagonal().setConstant(prior.sigma_rotation * prior.sigma_rotation);
  out.bottomRightCorner<3, 3>().diagonal().setConstant(sigma_translation * sigma_translation);
  out.bottomRightCorner<3, 3>() += prior.sigma_depth * prior.sigma_depth *
                                   (axis * axis.transpose() + axis_of_camera_0 * axis_of_camera_0.transpose());
  return out;
}

std::vector<double> baseline_weights(const ExtrinsicPrior& prior) {
  std::vector<double> out(prior.T_cam_rig.size(), 0.0);
  double sum = 0.0;
  for (std::size_t c = 1; c < num_with_baseline(prior); ++c) {
    const Vector3d& t = prior.T_cam_rig[c].translation();
    if (is_displaced(prior, c) || t.norm() < kNoBaseline) continue;
    out[c] = 1.0 / t.normalized().dot(covariance_of(prior, c).bottomRightCorner<3, 3>() * t.normalized());
    sum += out[c] * t.squaredNorm();
  }
  for (double& weight : out) weight = sum > 0 ? weight / sum : 0.0;
  return out;
}

double baseline_scale(std::span<const SE3> T_cam_rig, std::span<const double> weights) {
  double sum = 0.0;
  for (std::size_t c = 0; c < weights.size(); ++c) sum += weights[c] * T_cam_rig[c].translation().squaredNorm();
  return sum > 0 ? std::sqrt(sum) : 1.0;
}

std::vector<std::uint8_t> displaced_cameras(std::span<const SE3> T_cam_rig, const ExtrinsicPrior& prior) {
  constexpr std::size_t kMinBaselines = 3;
  constexpr double kDeviations = 4.0;
  const std::vector<SE3>& calibrated = prior.T_cam_rig;
  std::vector<std::uint8_t> out(calibrated.size(), 0);
  std::vector<double> ratios;
  const std::size_t n = num_with_baseline(prior);
  for (std::size_t c = 1; c < n; ++c) {
    const double length = calibrated[c].translation().norm();
    if (length > kDeviations * prior.sigma_translation) ratios.push_back(T_cam_rig[c].translation().norm() / length);
  }
  if (ratios.size() < kMinBaselines) return out;
  const double scale = lower_median(std::move(ratios));
  for (std::size_t c = 1; c < n; ++c) {
    const Vector3d change = extrinsic_change(geometry::scaled(T_cam_rig[c], 1.0 / scale), calibrated[c]).tail<3>();
    const Eigen::Matrix3d covariance = covariance_of(prior, c).bottomRightCorner<3, 3>();
    out[c] = change.dot(covariance.inverse() * change) > kDeviations * kDeviations;
  }
  if (2 * std::ranges::count(out, std::uint8_t{1}) >= static_cast<std::ptrdiff_t>(n))
    std::ranges::fill(out, std::uint8_t{0});
  return out;
}

Vector6d extrinsic_change(const SE3& T_cam_rig, const SE3& reference) {
  const SE3 D = T_cam_rig * reference.inverse();
  return (Vector6d() << geometry::so3_log(D.rotation()), D.translation()).finished();
}

ExtrinsicsBlock::ExtrinsicsBlock(ExtrinsicPrior prior) : prior_(std::move(prior)) {
  for (std::size_t c = 0; c < prior_.T_cam_rig.size(); ++c) information_.push_back(covariance_of(prior_, c).inverse());
  if (prior_.sigma_scale > 0) baseline_weights_ = baseline_weights(prior_);
}

double ExtrinsicsBlock::scale_error(const RigValues& values) const {
  if (baseline_weights_.empty()) return 0.0;
  return (baseline_scale(values.T_cam_rig, baseline_weights_) - 1.0) / prior_.sigma_scale;
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
  double sum = 0.0;
  for (std::size_t c = 1; c < values.T_cam_rig.size(); ++c) {
    const Vector6d change = extrinsic_change(values.T_cam_rig[c], prior_.T_cam_rig[c]);
    sum += change.dot(information_[c] * change);
  }
  const double scale = scale_error(values);
  return 0.5 * (sum + scale * scale);
}

void ExtrinsicsBlock::add_prior(const RigValues& values, Eigen::Ref<Eigen::MatrixXd> H,
                                Eigen::Ref<Eigen::VectorXd> b) const {
  for (std::size_t c = 1; c < values.T_cam_rig.size(); ++c) {
    const Vector6d change = extrinsic_change(values.T_cam_rig[c], prior_.T_cam_rig[c]);
    const Matrix6d J = change_jacobian(change);
    const Matrix6d JtI = J.transpose() * information_[c];
    const auto at = 6 * (static_cast<Eigen::Index>(c) - 1);
    H.block<6, 6>(at, at) += JtI * J;
    b.segment<6>(at) -= JtI * change;
  }
  if (baseline_weights_.empty()) return;
  // The distance |t| of a camera changes by t . v / |t| for the left perturbation (w, v) of T_cam_rig = [R, t].
  const double factor = 1.0 / (prior_.sigma_scale * baseline_scale(values.T_cam_rig, baseline_weights_));
  Eigen::VectorXd scale_jacobian = Eigen::VectorXd::Zero(size());
  for (std::size_t c = 1; c < values.T_cam_rig.size(); ++c)
    scale_jacobian.segment<3>(6 * (static_cast<Eigen::Index>(c) - 1) + 3) =
        factor * baseline_weights_[c] * values.T_cam_rig[c].translation();
  H += scale_jacobian * scale_jacobian.transpose();
  b -= scale_error(values) * scale_jacobian;
}

IntrinsicsBlock::IntrinsicsBlock(IntrinsicPrior prior) : prior_(std::move(prior)) {
  for (std::size_t c = 0; c < prior_.values.size(); ++c)
    add_columns(prior_.shared, static_cast<int>(prior_.values[c].size()), columns_, size_);
}

void IntrinsicsBlock::evaluate(const RigObservation& observation, Eigen::Ref<Jacobian> J) const {
  const auto c = static_cast<std::size_t>(observation.camera);
  J = camera::parameter_jacobian(observation.values.models[c], observation.point_cam) *
      (observation.inverse_sigma * prior_.sigmas[c]).asDiagonal();
}

void IntrinsicsBlock::apply(const Eigen::VectorXd& delta, RigValues& values) const {
  for (std::size_t c = 0; c < values.models.size(); ++c) {
    const camera::ModelParameters step =
        delta.segment(columns_[c].first, columns_[c].size).cwiseProduct(prior_.sigmas[c]);
    values.models[c] = camera::with_parameters(values.models[c], camera::parameters(values.models[c]) + step);
  }
}

Eigen::VectorXd IntrinsicsBlock::normalised_change(const RigValues& values) const {
  Eigen::VectorXd out(size());
  for (std::size_t c = 0; c < values.models.size(); ++c) {
    if (!has_own_unknowns(prior_.shared, c)) continue;
    out.segment(columns_[c].first, columns_[c].size) =
        (camera::parameters(values.models[c]) - prior_.values[c]).cwiseQuotient(prior_.sigmas[c]);
  }
  return out;
}

Vector2d IntrinsicsBlock::aspect_gradient(std::size_t camera) const {
  const camera::ModelParameters &value = prior_.values[camera], &sigma = prior_.sigmas[camera];
  if (prior_.sigma_aspect == 0) return Vector2d::Zero();
  return Vector2d(sigma(0) / value(0), -sigma(1) / value(1)) / prior_.sigma_aspect;
}

double IntrinsicsBlock::prior_cost(const RigValues& values) const {
  const Eigen::VectorXd change = normalised_change(values);
  double sum = change.squaredNorm();
  for (std::size_t c = 0; c < values.models.size(); ++c) {
    if (!has_own_unknowns(prior_.shared, c)) continue;
    const double aspect = aspect_gradient(c).dot(change.segment<2>(columns_[c].first));
    sum += aspect * aspect;
  }
  return 0.5 * sum;
}

void IntrinsicsBlock::add_prior(const RigValues& values, Eigen::Ref<Eigen::MatrixXd> H,
                                Eigen::Ref<Eigen::VectorXd> b) const {
  const Eigen::VectorXd change = normalised_change(values);
  H.diagonal().array() += 1.0;
  b -= change;
  for (std::size_t c = 0; c < values.models.size(); ++c) {
    if (!has_own_unknowns(prior_.shared, c)) continue;
    const int first = columns_[c].first;
    const Vector2d gradient = aspect_gradient(c);
    H.block<2, 2>(first, first) += gradient * gradient.transpose();
    b.segment<2>(first) -= gradient.dot(change.segment<2>(first)) * gradient;
  }
}

TimingBlock::TimingBlock(std::vector<TimingPrior> prior, const SharedUnknowns& shared) : prior_(std::move(prior)) {
  for (const TimingPrior& p : prior_) add_columns(shared, (p.sigma_shift > 0) + (p.sigma_readout > 0), columns_, size_);
}

void TimingBlock::evaluate(const RigObservation& observation, Eigen::Ref<Jacobian> J) const {
  const TimingPrior& p = prior_[static_cast<std::size_t>(observation.camera)];
  const Vector2d per_second = observation.J * observation.velocity;
  Eigen::Index column = 0;
  if (p.sigma_shift > 0) J.col(column++) = p.sigma_shift * per_second;
  if (p.sigma_readout > 0) J.col(column) = p.sigma_readout * observation.relative_row * per_second;
}

void TimingBlock::apply(const Eigen::VectorXd& delta, RigValues& values) const {
  for (std::size_t c = 0; c < prior_.size(); ++c) {
    Eigen::Index at = columns_[c].first;
    if (prior_[c].sigma_shift > 0) values.timing[c].shift_s += prior_[c].sigma_shift * delta(at++);
    if (prior_[c].sigma_readout > 0) values.timing[c].readout_s += prior_[c].sigma_readout * delta(at);
  }
}

Eigen::VectorXd TimingBlock::normalised_change(const RigValues& values) const {
  Eigen::VectorXd out(size());
  for (std::size_t c = 0; c < prior_.size(); ++c) {
    const TimingPrior& p = prior_[c];
    Eigen::Index at = columns_[c].first;
    if (p.sigma_shift > 0) out(at++) = (values.timing[c].shift_s - p.mean.shift_s) / p.sigma_shift;
    if (p.sigma_readout > 0) out(at) = (values.timing[c].readout_s - p.mean.readout_s) / p.sigma_readout;
  }
  return out;
}

double TimingBlock::prior_cost(const RigValues& values) const { return 0.5 * normalised_change(values).squaredNorm(); }

void TimingBlock::add_prior(const RigValues& values, Eigen::Ref<Eigen::MatrixXd> H,
                            Eigen::Ref<Eigen::VectorXd> b) const {
  H.diagonal().array() += 1.0;
  b -= normalised_change(values);
}

void BaselineScaleBlock::evaluate(const RigObservation& observation, Eigen::Ref<Jacobian> J) const {
  J = observation.J * observation.values.T_cam_rig[static_cast<std::size_t>(observation.camera)].translation();
}

void BaselineScaleBlock::apply(const Eigen::VectorXd& delta, RigValues& values) const {
  for (SE3& T : values.T_cam_rig) T = geometry::scaled(T, 1.0 + delta(0));
}

}  // namespace bslam::solver
