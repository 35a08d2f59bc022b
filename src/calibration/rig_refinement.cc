#include "calibration/rig_refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "calibration/calibration_prior.h"
#include "calibration/deviation.h"
#include "calibration/move_search.h"
#include "calibration/path_scale.h"
#include "calibration/rig_frame.h"
#include "calibration/single_view_landmarks.h"
#include "calibration/unobserved_cameras.h"

namespace bslam::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMillimetresPerMetre = 1000.0, kMillisecondsPerSecond = 1000.0;

std::vector<ParameterRefinement> evaluate_intrinsics(const CameraEstimate& estimate, const camera::CameraModel& model) {
  std::vector<ParameterRefinement> out;
  for (const std::string& name : camera::parameter_names(model)) {
    const auto k = static_cast<Eigen::Index>(out.size());
    out.push_back(
        {name, estimate.intrinsics_change(k), estimate.intrinsics_sigma(k), estimate.intrinsics_observed[out.size()]});
  }
  return out;
}

void evaluate_extrinsics(const CameraEstimate& estimate, const CalibrationOptions& options, CameraRefinement& out) {
  const Vector3d rotation = estimate.change.head<3>(), translation = estimate.change.tail<3>();
  const Matrix3d rotation_covariance = estimate.covariance.topLeftCorner<3, 3>(),
                 translation_covariance = estimate.covariance.bottomRightCorner<3, 3>();
  out.change_deg = geometry::degrees(rotation.norm());
  out.change_mm = translation.norm() * kMillimetresPerMetre;
  out.unobserved_mm = estimate.unobserved_shift * kMillimetresPerMetre;
  out.std_deg = geometry::degrees(largest_deviation(rotation_covariance));
  out.std_mm = largest_deviation(translation_covariance) * kMillimetresPerMetre;
  out.rotation_sigmas = mahalanobis_distance(rotation, rotation_covariance);
  out.translation_sigmas = mahalanobis_distance(translation, translation_covariance);
  out.suspect = (out.rotation_sigmas > options.suspect_sigmas && out.change_deg > options.suspect_deg) ||
                (out.translation_sigmas > options.suspect_sigmas && out.change_mm > options.suspect_mm);
}

void evaluate_timing(const CameraEstimate& estimate, CameraRefinement& out) {
  const auto in_ms = [](double change_s, double sigma_s) {
    return TimeRefinement{kMillisecondsPerSecond * change_s, kMillisecondsPerSecond * sigma_s, sigma_s > 0};
  };
  out.time_offset = in_ms(estimate.timing_change.shift_s, estimate.timing_sigma.shift_s);
  out.readout = in_ms(estimate.timing_change.readout_s, estimate.timing_sigma.readout_s);
}

map::SetPoses poses_of(const adjustment::BundleProblem& bundle) {
  map::SetPoses out;
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i)
    out.keyframes.emplace_back(bundle.keyframes[i], bundle.problem.T_rig_world[i]);
  for (std::size_t i = 0; i < bundle.landmarks.size(); ++i) {
    if (bundle.problem.points[i].allFinite()) out.landmarks.emplace_back(bundle.landmarks[i], bundle.problem.points[i]);
  }
  return out;
}

}  // namespace

std::string_view verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::kUnknown:
      return "unknown";
    case Verdict::kConsistent:
      return "consistent";
    case Verdict::kInconsistent:
      return "inconsistent";
  }
  return "";
}

namespace {

// Without metric scale, errors of extrinsics in millimetres have no meaning in the map. A single camera has none.
bool can_refine(const map::BundledMap& map) {
  return map.num_keyframes() > 0 && (map.rig().size() == 1 || map.scale() == map::Scale::kMetric);
}

MovedCameras moves_of_map(const map::BundledMap& map) {
  return {map.rig().size(), {map.rig().moves().begin(), map.rig().moves().end()}};
}

// The change of the scale of the map, and its deviation.
void evaluate_scale(const EstimateInput& input, const RigEstimate& estimate, RigRefinement& out) {
  // If the path is longer than the longest baseline, the change of its length is the change of scale. Otherwise the
  // scale is that of the baselines.
  out.scale_change = estimate.adjusted.scale_change;
  if (estimate.path_before <= longest_baseline(input.calibrated)) return;
  out.scale_change = path_length(estimate.problem) / estimate.path_before;
  if (!estimate.adjusted.pose_effects.empty())
    out.scale_deviation = path_deviation(estimate.problem, estimate.adjusted.pose_effects) / estimate.path_before;
}

// A camera was displaced by far more than calibrations are wrong, in directions that the images do not constrain. Their
// errors are not those of a calibration, but those of time stamps that jitter, for example.
bool is_implausible(const std::vector<CameraRefinement>& cameras, const camera::Rig& calibrated) {
  constexpr double kMaxOfBaseline = 0.1;
  const double limit_mm = kMaxOfBaseline * kMillimetresPerMetre * longest_baseline(calibrated);
  return std::ranges::any_of(cameras, [&](const CameraRefinement& camera) { return camera.unobserved_mm > limit_mm; });
}

RigRefinement evaluate(const EstimateInput& input, RigEstimate&& estimate) {
  RigRefinement out;
  RigAdjustment& adjusted = estimate.adjusted;
  out.keyframes = estimate.problem.selected.keyframes.size();
  out.landmarks = estimate.problem.selected.landmarks.size();
  if (!adjusted.done) return out;
  const camera::Rig reference = with_time_offsets_of(input.map.rig(), input.calibrated);
  const std::vector<camera::CameraMove>& of_estimate = estimate.cameras.moves();
  for (std::size_t m = 0; m < of_estimate.size(); ++m) {
    const CameraEstimate& after = adjusted.cameras[reference.size() + m];
    adjusted.cameras[of_estimate[m].camera].observations += after.observations;
  }
  complete_unobserved_cameras(reference, adjusted);
  out.done = true;
  for (std::size_t c = 0; c < input.map.rig().size(); ++c) {
    CameraRefinement& camera = out.cameras.emplace_back();
    camera.observed = adjusted.cameras[c].observed;
    camera.observations = adjusted.cameras[c].observations;
    camera.intrinsics = evaluate_intrinsics(adjusted.cameras[c], input.calibrated.camera(c).model);
    if (c > 0) evaluate_extrinsics(adjusted.cameras[c], input.options, camera);
    evaluate_timing(adjusted.cameras[c], camera);
  }
  out.jump = estimate.jump;
  out.unsteady = estimate.unsteady;
  out.implausible = out.jump || out.unsteady || is_implausible(out.cameras, input.calibrated);
  out.moves = moves_of(estimate);
  out.excess_error = adjusted.excess_error;
  out.verdict = out.excess_error > input.options.inconsistent_excess ? Verdict::kInconsistent : Verdict::kConsistent;
  out.information = estimate.cameras.of_rig(adjusted.information);
  evaluate_scale(input, estimate, out);
  const std::vector<camera::CameraMove> moves = estimate.cameras.moves_of(adjusted.values);
  const camera::Rig refined = estimate.cameras.of_rig(adjusted.values).applied_to(reference);
  const geometry::SE3 T_cam0_rig =
      turn_of_rays(refined.camera(0), reference.camera(0)) * input.calibrated.cam_from_rig(0);
  out.rig = with_rig_frame(refined, T_cam0_rig, input.calibrated.body_from_rig()).with_moves(moves);
  move_to_rig_frame(T_cam0_rig, input.map.rig().cam_from_rig(0), estimate.problem);
  out.poses = poses_of(estimate.problem.selected);
  return out;
}

}  // namespace

RigRefinement refine_rig(const map::BundledMap& map, const camera::Rig& calibrated, const CalibrationOptions& options,
                         const feature::FeatureModel& features, std::stop_token stop, KeyframeId first) {
  if (!can_refine(map)) return {};
  const EstimateInput input{map, calibrated, options, features, stop, first};
  const MovedCameras cameras = moves_of_map(map);
  return evaluate(input, estimate_rig_and_moves(input, prior_with_timing(input, cameras), cameras));
}

Eigen::MatrixXd prior_information(const camera::Rig& calibrated, const CalibrationOptions& options) {
  const camera::Rig rig = calibrated.in_frame_of_camera_0();
  return prior_information(solver::RigValues::of(rig), prior_without_timing(rig, options));
}

bool accepted(const RigRefinement& refinement, const CalibrationOptions& options) {
  if (!refinement.done || refinement.implausible || options.refine == Refine::kFalse) return false;
  return options.refine == Refine::kTrue || refinement.verdict == Verdict::kInconsistent;
}

bool replaced(const camera::Rig& of_map, const camera::Rig& calibrated) {
  for (std::size_t c = 1; c < calibrated.size(); ++c) {
    if (of_map.body_from_cam(c).matrix() != calibrated.body_from_cam(c).matrix()) return true;
  }
  return camera::parameters(of_map.camera(0).model) != camera::parameters(calibrated.camera(0).model);
}

std::optional<RigRefinement> refine_if_accepted(const map::BundledMap& map, const camera::Rig& calibrated,
                                                const CalibrationOptions& options,
                                                const feature::FeatureModel& features, const std::stop_token& stop,
                                                KeyframeId first) {
  if (options.refine == Refine::kFalse || !can_refine(map)) return std::nullopt;
  const EstimateInput input{map, calibrated, options, features, stop, first};
  const MovedCameras cameras = moves_of_map(map);
  const RigAdjustmentOptions prior = prior_with_timing(input, cameras);
  if (options.refine == Refine::kAuto && !replaced(map.rig(), calibrated)) {
    const CalibrationOptions fraction = quick(options);
    const EstimateInput of_fraction{map, calibrated, fraction, features, stop};
    const RigRefinement verdict = evaluate(of_fraction, estimate_rig(of_fraction, for_verdict(prior), cameras));
    if (!accepted(verdict, options)) return std::nullopt;
  }
  RigRefinement out = evaluate(input, estimate_rig_and_moves(input, prior, cameras));
  return accepted(out, options) ? std::optional(std::move(out)) : std::nullopt;
}

void move_submap(KeyframeId keyframe, const geometry::SE3& T_rig_world, map::MapDraft& draft) {
  const map::BundledMap& map = draft.map();
  const geometry::SE3 T_new_old = T_rig_world.inverse() * map.keyframe(keyframe).T_rig_world,
                      T_old_new = T_new_old.inverse();
  const KeyframeId root = map.root_of(keyframe);
  const map::BundledKeyframe& before = map.keyframe(root);
  // Replaces the uncertainty of the root by its displacement from the identity, and adds this change to the others.
  const geometry::Vector6d displacement = (before.T_rig_world * T_old_new).log();
  const geometry::PoseUncertainty added{displacement * displacement.transpose() - before.uncertainty.noise};
  map::SetPoses poses{.keyframes = {}, .landmarks = {}, .correction = true};
  for (const KeyframeId k : map.keyframes_of_submap(root)) {
    const geometry::SE3& T_k_world = map.keyframe(k).T_rig_world;
    poses.keyframes.emplace_back(k, T_k_world * T_old_new);
    poses.uncertainties.emplace_back(
        k, map.keyframe(k).uncertainty + geometry::transported(added, T_k_world * before.T_rig_world.inverse()));
  }
  const std::vector<KeyframeId> root_of_each = map.root_of_each();
  for (const LandmarkId l : map.landmark_ids()) {
    if (root_of_each[map.landmark(l).reference.keyframe.index()] == root)
      poses.landmarks.emplace_back(l, T_new_old * map.landmark(l).position);
  }
  draft.set_poses(std::move(poses));
}

namespace {

// Returns L, (n, n + 1) for the n unknowns of RigInformation: the first n columns are a square root of the covariance
// of the estimate, the last one is the change of the camera translations that keep_scale() withheld. The extrinsics are
// those before moves of cameras; their deviation is taken for those after them as well. Returns null if the information
// is not positive definite.
std::shared_ptr<const Eigen::MatrixXd> deviation_of(const RigRefinement& refinement) {
  const Eigen::LLT<Eigen::MatrixXd> factor(refinement.information.information);
  if (factor.info() != Eigen::Success) return nullptr;
  const auto n = factor.rows();
  Eigen::MatrixXd L = Eigen::MatrixXd::Zero(n, n + 1);
  L.leftCols(n) = factor.matrixU().solve(Eigen::MatrixXd::Identity(n, n));
  for (std::size_t c = 1; c < refinement.rig->size(); ++c)
    L.col(n).segment<3>(6 * (static_cast<Eigen::Index>(c) - 1) + 3) =
        std::log(refinement.kept_scale) * refinement.rig->cam_from_rig(c).translation();
  return std::make_shared<const Eigen::MatrixXd>(std::move(L));
}

}  // namespace

void apply(const RigRefinement& refinement, map::MapDraft& draft) {
  for (const KeyframeId root : draft.map().roots()) draft.scale_submap(root, refinement.scale_change);
  draft.set_rig(*refinement.rig, deviation_of(refinement));
  draft.set_poses(refinement.poses);
  triangulate_single_views(draft);
}

}  // namespace bslam::calibration
