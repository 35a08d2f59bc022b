#include "calibration/rig_refinement.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "adjustment/landmark_noise.h"
#include "calibration/lost_observations.h"
#include "calibration/path_scale.h"
#include "calibration/rig_bundle_adjustment.h"
#include "calibration/rig_frame.h"
#include "calibration/rig_problem.h"
#include "calibration/single_view_landmarks.h"
#include "calibration/unobserved_cameras.h"

namespace bslam::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMillimetresPerMetre = 1000.0, kMillisecondsPerSecond = 1000.0;
// Maximum number of adjustments. Before each one but the first, rejected observations are searched for again.
constexpr int kPasses = 4;
// Relative decrease of the cost at which preliminary adjustments stop. The sum of squared errors of 10,000 observations
// then changes by about one; since correlated observations count less, the parameters are within a fraction of a
// standard deviation of the optimum, which does not change a decision.
constexpr double kCoarseDecrease = 1e-4;
constexpr int kQuickKeyframes = 40, kQuickLandmarks = 1000;  // enough for a verdict

// The options for an estimate from a fraction of the map.
CalibrationOptions quick(CalibrationOptions options) {
  options.keyframes = std::min(options.keyframes, kQuickKeyframes);
  options.landmarks = std::min(options.landmarks, kQuickLandmarks);
  return options;
}

// Options of an adjustment from which only the verdict is used: coarser convergence, no effects on the poses.
RigAdjustmentOptions for_verdict(RigAdjustmentOptions options) {
  options.relative_decrease = kCoarseDecrease;
  options.pose_effects = false;
  return options;
}

// Square root of the largest eigenvalue.
double largest_deviation(const Matrix3d& covariance) {
  return std::sqrt(
      Eigen::SelfAdjointEigenSolver<Matrix3d>(covariance, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff());
}

double mahalanobis_distance(const Vector3d& change, const Matrix3d& covariance) {
  return std::sqrt(change.dot(covariance.llt().solve(change)));
}

// The size of a rig: the longest distance of a camera from camera 0.
double longest_baseline(const camera::Rig& rig) {
  double longest = 0;
  for (std::size_t c = 1; c < rig.size(); ++c) longest = std::max(longest, rig.cam_from_rig(c).translation().norm());
  return longest;
}

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
  out.std_deg = geometry::degrees(largest_deviation(rotation_covariance));
  out.std_mm = largest_deviation(translation_covariance) * kMillimetresPerMetre;
  out.rotation_sigmas = mahalanobis_distance(rotation, rotation_covariance);
  out.translation_sigmas = mahalanobis_distance(translation, translation_covariance);
  out.suspect = (out.rotation_sigmas > options.suspect_sigmas && out.change_deg > options.suspect_deg) ||
                (out.translation_sigmas > options.suspect_sigmas && out.change_mm > options.suspect_mm);
}

// Returns true if no extrinsics have moved from `before` by more than their own uncertainty.
bool converged(const RigAdjustment& adjusted, const solver::RigValues& before) {
  for (std::size_t c = 1; c < before.T_cam_rig.size(); ++c) {
    const geometry::Vector6d change = solver::extrinsic_change(adjusted.values.T_cam_rig[c], before.T_cam_rig[c]);
    if (change.dot(adjusted.cameras[c].covariance.llt().solve(change)) > static_cast<double>(change.size()))
      return false;
  }
  return true;
}

// Adjusts again with the variance of each landmark (adjustment/landmark_noise.h), from the estimate `from`.
RigAdjustment adjust_weighted(RigAdjustmentOptions options, RigAdjustment from, RigProblem& problem,
                              const std::stop_token& stop) {
  solver::ReprojectionProblem& flat = problem.flat.problem;
  const auto chi2 = solver::squared_errors(flat, flat.T_rig_world, flat.points, from.values);
  adjustment::apply_variances(adjustment::landmark_variances(flat, chi2, solver::beyond(chi2, solver::kChi2TwoDof95)),
                              flat);
  options.start_is_estimate = true;
  RigAdjustment out = adjust_rig(flat, options, from.values, stop);
  if (!out.done) return from;
  out.scale_change *= from.scale_change;
  return out;
}

// A map built with a wrong calibration contains mostly the observations that agree with it, so adjusting it once stops
// short of the truth. Therefore the rejected observations are searched again with the new calibration.
RigAdjustment adjust_in_passes(const map::BundledMap& map, const feature::FeatureModel& features,
                               const RigAdjustmentOptions& options, RigProblem& problem, const std::stop_token& stop) {
  RigAdjustmentOptions coarse = options;
  coarse.relative_decrease = kCoarseDecrease;
  solver::RigValues before = solver::RigValues::of(map.rig().in_frame_of_camera_0());
  separate_groups(problem);
  RigAdjustment out = adjust_rig(problem.flat.problem, coarse, before, stop);
  for (int pass = 1; pass < kPasses && out.done && !converged(out, before); ++pass) {
    before = out.values;
    if (recover_observations(map, before.applied_to(map.rig()), features, problem.flat) == 0) break;
    separate_groups(problem);
    RigAdjustment again = adjust_rig(problem.flat.problem, coarse, before, stop);
    if (!again.done) break;
    again.scale_change *= out.scale_change;
    out = std::move(again);
  }
  return out.done ? adjust_weighted(options, std::move(out), problem, stop) : out;
}

RigAdjustmentOptions prior_without_timing(const camera::Rig& rig, const CalibrationOptions& options) {
  RigAdjustmentOptions out{.sigma_rotation = geometry::radians(options.sigma_rotation_deg),
                           .sigma_translation = translation_deviation(rig, options),
                           .sigma_depth = options.sigma_depth_mm / kMillimetresPerMetre,
                           .sigma_scale = 0.01 * options.sigma_scale_percent,
                           .sigma_aspect = 0.01 * options.sigma_aspect_percent,
                           .correlated_observations = options.correlated_observations};
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const camera::Camera& camera = rig.camera(c);
    out.sigma_intrinsics.push_back(camera::typical_sigmas(camera.model, 0.01 * options.sigma_focal_percent,
                                                          0.01 * options.sigma_centre_percent * camera.width));
  }
  return out;
}

// `rig` with the time offsets that were applied to the images of the map, and the frame of camera 0 as the rig frame.
camera::Rig with_time_offsets_of(const camera::Rig& of_map, const camera::Rig& rig) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
    cameras.back().camera.time_offset_ns = of_map.camera(c).time_offset_ns;
  }
  return camera::Rig(std::move(cameras));
}

// Prior of the time offsets, relative to those applied to the images of the map, and of the readout times.
std::vector<solver::TimingPrior> timing_prior(const camera::Rig& of_map, const camera::Rig& calibrated,
                                              const CalibrationOptions& options) {
  std::vector<solver::TimingPrior> out;
  for (std::size_t c = 0; c < calibrated.size(); ++c) {
    const camera::Camera& camera = calibrated.camera(c);
    const double shift_s = to_seconds(camera.time_offset_ns - of_map.camera(c).time_offset_ns);
    out.push_back({{shift_s, camera.readout_s},
                   c == 0 ? 0.0 : options.sigma_time_offset_ms / kMillisecondsPerSecond,
                   options.sigma_readout_ms / kMillisecondsPerSecond});
  }
  return out;
}

// Returns true if a time changed by more than `suspect_sigmas` standard deviations and `suspect_ms`.
bool significant(double change_s, double sigma_s, const CalibrationOptions& options) {
  return std::abs(change_s) > std::max(options.suspect_sigmas * sigma_s, options.suspect_ms / kMillisecondsPerSecond);
}

// Estimates all times from a fraction of the map, and returns the prior of those that the images contradict; empty if
// there are none. All others are constant.
std::vector<solver::TimingPrior> contradicted_timing(const map::BundledMap& map, const camera::Rig& reference,
                                                     std::vector<solver::TimingPrior> timing,
                                                     const CalibrationOptions& options,
                                                     const feature::FeatureModel& features,
                                                     const std::stop_token& stop) {
  RigProblem problem = choose(map, true, quick(options), features);
  problem.flat.problem.rig = &reference;
  separate_groups(problem);
  RigAdjustmentOptions with_timing = for_verdict(prior_without_timing(reference, options));
  with_timing.timing = timing;
  const auto adjusted =
      adjust_rig(problem.flat.problem, with_timing, solver::RigValues::of(map.rig().in_frame_of_camera_0()), stop);
  if (!adjusted.done) return {};
  bool any = false;
  for (std::size_t c = 0; c < timing.size(); ++c) {
    const CameraEstimate& estimate = adjusted.cameras[c];
    if (!significant(estimate.timing_change.shift_s, estimate.timing_sigma.shift_s, options)) timing[c].sigma_shift = 0;
    if (!significant(estimate.timing_change.readout_s, estimate.timing_sigma.readout_s, options))
      timing[c].sigma_readout = 0;
    any |= timing[c].sigma_shift > 0 || timing[c].sigma_readout > 0;
  }
  return any ? timing : std::vector<solver::TimingPrior>{};
}

void evaluate_timing(const CameraEstimate& estimate, CameraRefinement& out) {
  const auto in_ms = [](double change_s, double sigma_s) {
    return TimeRefinement{kMillisecondsPerSecond * change_s, kMillisecondsPerSecond * sigma_s, sigma_s > 0};
  };
  out.time_offset = in_ms(estimate.timing_change.shift_s, estimate.timing_sigma.shift_s);
  out.readout = in_ms(estimate.timing_change.readout_s, estimate.timing_sigma.readout_s);
}

map::SetPoses poses_of(const adjustment::BundleProblem& flat) {
  map::SetPoses out;
  for (std::size_t i = 0; i < flat.keyframes.size(); ++i)
    out.keyframes.emplace_back(flat.keyframes[i], flat.problem.T_rig_world[i]);
  for (std::size_t i = 0; i < flat.landmarks.size(); ++i) {
    if (flat.problem.points[i].allFinite()) out.landmarks.emplace_back(flat.landmarks[i], flat.problem.points[i]);
  }
  return out;
}

}  // namespace

double translation_deviation(const camera::Rig& rig, const CalibrationOptions& options) {
  return std::hypot(options.sigma_translation_mm / kMillimetresPerMetre,
                    0.01 * options.sigma_translation_percent * longest_baseline(rig));
}

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

// Without metric scale, calibration errors in millimetres have no meaning in the map.
bool can_refine(const map::BundledMap& map) {
  return map.rig().size() >= 2 && map.num_keyframes() > 0 && map.scale() == map::Scale::kMetric;
}

// The prior of all parameters that are estimated from the map.
RigAdjustmentOptions prior_with_timing(const map::BundledMap& map, const camera::Rig& calibrated,
                                       const CalibrationOptions& options, const feature::FeatureModel& features,
                                       const std::stop_token& stop) {
  RigAdjustmentOptions prior = prior_without_timing(calibrated, options);
  prior.timing = contradicted_timing(map, with_time_offsets_of(map.rig(), calibrated),
                                     timing_prior(map.rig(), calibrated, options), options, features, stop);
  return prior;
}

RigRefinement refine_with_prior(const map::BundledMap& map, const camera::Rig& calibrated,
                                const RigAdjustmentOptions& prior, const CalibrationOptions& options,
                                const feature::FeatureModel& features, const std::stop_token& stop) {
  RigRefinement out;
  const camera::Rig reference = with_time_offsets_of(map.rig(), calibrated);
  RigProblem problem = choose(map, !prior.timing.empty(), options, features);
  problem.flat.problem.rig = &reference;
  out.keyframes = problem.flat.keyframes.size();
  out.landmarks = problem.flat.landmarks.size();
  const double path_before = path_length(problem);
  RigAdjustment adjusted = adjust_in_passes(map, features, prior, problem, stop);
  if (!adjusted.done) return out;
  complete_unobserved_cameras(reference, adjusted);
  out.done = true;
  for (std::size_t c = 0; c < map.rig().size(); ++c) {
    CameraRefinement& camera = out.cameras.emplace_back();
    camera.observed = adjusted.cameras[c].observed;
    camera.observations = adjusted.cameras[c].observations;
    camera.intrinsics = evaluate_intrinsics(adjusted.cameras[c], calibrated.camera(c).model);
    if (c > 0) evaluate_extrinsics(adjusted.cameras[c], options, camera);
    evaluate_timing(adjusted.cameras[c], camera);
  }
  out.excess_error = adjusted.excess_error;
  out.verdict = out.excess_error > options.inconsistent_excess ? Verdict::kInconsistent : Verdict::kConsistent;
  out.information = adjusted.information;
  // If the path is longer than the longest baseline, the change of its length is the change of scale. Otherwise the
  // scale is that of the baselines.
  out.scale_change = adjusted.scale_change;
  if (path_before > longest_baseline(calibrated)) {
    out.scale_change = path_length(problem) / path_before;
    if (!adjusted.pose_effects.empty())
      out.scale_deviation = path_deviation(problem, adjusted.pose_effects) / path_before;
  }
  const camera::Rig refined = adjusted.values.applied_to(reference);
  const geometry::SE3 T_cam0_rig = turn_of_rays(refined.camera(0), reference.camera(0)) * calibrated.cam_from_rig(0);
  out.rig = with_rig_frame(refined, T_cam0_rig, calibrated.body_from_rig());
  move_to_rig_frame(T_cam0_rig, map.rig().cam_from_rig(0), problem);
  out.poses = poses_of(problem.flat);
  return out;
}

}  // namespace

RigRefinement refine_rig(const map::BundledMap& map, const camera::Rig& calibrated, const CalibrationOptions& options,
                         const feature::FeatureModel& features, std::stop_token stop) {
  if (!can_refine(map)) return {};
  const auto prior = prior_with_timing(map, calibrated, options, features, stop);
  return refine_with_prior(map, calibrated, prior, options, features, stop);
}

Eigen::MatrixXd prior_information(const camera::Rig& calibrated, const CalibrationOptions& options) {
  const camera::Rig rig = calibrated.in_frame_of_camera_0();
  return prior_information(solver::RigValues::of(rig), prior_without_timing(rig, options));
}

bool accepted(const RigRefinement& refinement, const CalibrationOptions& options) {
  if (!refinement.done || options.refine == Refine::kFalse) return false;
  return options.refine == Refine::kTrue || refinement.verdict == Verdict::kInconsistent;
}

bool replaced(const camera::Rig& of_map, const camera::Rig& calibrated) {
  for (std::size_t c = 1; c < calibrated.size(); ++c) {
    if (of_map.body_from_cam(c).matrix() != calibrated.body_from_cam(c).matrix()) return true;
  }
  return false;
}

std::optional<RigRefinement> refine_if_accepted(const map::BundledMap& map, const camera::Rig& calibrated,
                                                const CalibrationOptions& options,
                                                const feature::FeatureModel& features, const std::stop_token& stop) {
  if (options.refine == Refine::kFalse || !can_refine(map)) return std::nullopt;
  const auto prior = prior_with_timing(map, calibrated, options, features, stop);
  if (options.refine == Refine::kAuto && !replaced(map.rig(), calibrated)) {
    const RigRefinement first = refine_with_prior(map, calibrated, for_verdict(prior), quick(options), features, stop);
    if (!accepted(first, options)) return std::nullopt;
  }
  RigRefinement out = refine_with_prior(map, calibrated, prior, options, features, stop);
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
// of the estimate, the last one is the change of the camera translations that keep_scale() withheld. Returns null if
// the information is not positive definite.
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
