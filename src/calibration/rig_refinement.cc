#include "calibration/rig_refinement.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "adjustment/bundle_problem.h"
#include "adjustment/landmark_noise.h"
#include "calibration/lost_observations.h"
#include "solver/rig_bundle_adjustment.h"

namespace bslam::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMillimetres = 1000.0, kMilliseconds = 1000.0;
constexpr std::size_t kSegment = 10;  // consecutive keyframes chosen together, so that they share landmarks
// maximum number of passes; each searches again for observations that the previous extrinsics rejected
constexpr int kPasses = 4;
constexpr int kQuickKeyframes = 40, kQuickLandmarks = 1000;  // enough for a verdict
constexpr int kMinShared = 15;  // minimum number of shared landmarks for one keyframe to constrain another

// The options for an estimate from a fraction of the map.
CalibrationOptions quick(CalibrationOptions options) {
  options.keyframes = std::min(options.keyframes, kQuickKeyframes);
  options.landmarks = std::min(options.landmarks, kQuickLandmarks);
  return options;
}

// Whether the velocity of a keyframe is known. The images of others show a rig whose late cameras and rolling shutters
// are in the wrong place.
bool motion_known(const map::BundledMap& map, KeyframeId k) { return !map.keyframe(k).twist.isZero(0); }

// The keyframes that can be used, in order of id. `timing`: the timing of the cameras is estimated.
std::vector<KeyframeId> usable_keyframes(const map::BundledMap& map, bool timing) {
  std::vector<KeyframeId> out = map.keyframe_ids();
  std::erase_if(out, [&](KeyframeId k) {
    return !motion_known(map, k) && (timing || frame::depends_on_motion(map.rig(), *map.keyframe(k).frame));
  });
  return out;
}

// Returns all of these keyframes, or evenly spaced segments of consecutive ones if there are more than `limit`.
std::vector<KeyframeId> choose_keyframes(const std::vector<KeyframeId>& all, std::size_t limit) {
  if (all.size() <= limit) return all;
  const std::size_t segments = std::max<std::size_t>(1, limit / kSegment);
  std::vector<KeyframeId> out;
  for (std::size_t s = 0; s < segments; ++s) {
    const std::size_t first = segments == 1 ? 0 : s * (all.size() - kSegment) / (segments - 1);
    for (std::size_t k = first; k < std::min(first + kSegment, all.size()); ++k) out.push_back(all[k]);
  }
  return out;
}

// Observations of a landmark: the number of chosen keyframes, the first segment, and the cameras that observe it.
struct Candidate {
  int keyframes = 0;
  std::size_t segment = 0;
  std::vector<std::uint8_t> cameras;
};

Candidate look_up(const map::BundledMap& map, LandmarkId landmark, const std::vector<int>& position) {
  Candidate out;
  out.cameras.assign(map.rig().size(), 0);
  for (const map::Observation& o : map.observations(landmark)) {
    const int at = position[o.keyframe.index()];
    if (at < 0) continue;
    if (out.keyframes++ == 0) out.segment = static_cast<std::size_t>(at) / kSegment;
    for (const frame::KeypointRef r : map.keyframe(o.keyframe).frame->bundled.keypoints(o.feature))
      out.cameras[r.camera.index()] = 1;
  }
  return out;
}

std::vector<int> positions(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<int> out(map.keyframe_slots(), -1);
  for (std::size_t i = 0; i < keyframes.size(); ++i) out[keyframes[i].index()] = static_cast<int>(i);
  return out;
}

// Segments and cameras alternate in choosing the landmark observed by the most keyframes; the result is in order of
// id.
std::vector<LandmarkId> choose_landmarks(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes,
                                         std::size_t limit) {
  const std::vector<int> position = positions(map, keyframes);
  const std::size_t segments = (keyframes.size() + kSegment - 1) / kSegment, cameras = map.rig().size();
  // negated number of keyframes, so that sorting puts the largest first
  std::vector<std::vector<std::pair<int, LandmarkId>>> queues(segments * cameras);
  for (const LandmarkId l : map.landmark_ids()) {
    const Candidate candidate = look_up(map, l, position);
    if (candidate.keyframes < 2) continue;
    for (std::size_t c = 0; c < cameras; ++c) {
      if (candidate.cameras[c] != 0) queues[candidate.segment * cameras + c].emplace_back(-candidate.keyframes, l);
    }
  }
  for (auto& queue : queues) std::sort(queue.begin(), queue.end());
  std::vector<std::uint8_t> taken(map.landmark_slots(), 0);
  std::vector<std::size_t> next(queues.size(), 0);
  std::vector<LandmarkId> out;
  for (bool any = true; any && out.size() < limit;) {
    any = false;
    for (std::size_t q = 0; q < queues.size() && out.size() < limit; ++q) {
      while (next[q] < queues[q].size() && taken[queues[q][next[q]].second.index()] != 0) ++next[q];
      if (next[q] == queues[q].size()) continue;
      const LandmarkId l = queues[q][next[q]++].second;
      taken[l.index()] = 1;
      out.push_back(l);
      any = true;
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

// Assigns each keyframe to a group of keyframes connected, directly or indirectly, by shared landmarks. Returns, per
// keyframe, the index of the first keyframe of its group.
std::vector<std::size_t> groups(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes,
                                const std::vector<LandmarkId>& landmarks) {
  const std::vector<int> position = positions(map, keyframes);
  const std::size_t n = keyframes.size();
  std::vector<int> shared(n * n, 0);
  std::vector<std::size_t> seen;
  for (const LandmarkId l : landmarks) {
    seen.clear();
    for (const map::Observation& o : map.observations(l)) {
      if (position[o.keyframe.index()] >= 0) seen.push_back(static_cast<std::size_t>(position[o.keyframe.index()]));
    }
    for (const std::size_t a : seen) {
      for (const std::size_t b : seen) ++shared[a * n + b];
    }
  }
  std::vector<std::size_t> group(n);
  std::iota(group.begin(), group.end(), 0u);
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = a + 1; b < n; ++b) {
      if (shared[a * n + b] < kMinShared || group[a] == group[b]) continue;
      const std::size_t kept = std::min(group[a], group[b]), gone = std::max(group[a], group[b]);
      std::replace(group.begin(), group.end(), gone, kept);
    }
  }
  return group;
}

// The adjustment problem and the group of each of its poses.
struct RigProblem {
  adjustment::BundleProblem flat;
  std::vector<std::size_t> group;
};

// Each group has its own gauge freedom. One keyframe per group is fixed, which does not constrain the extrinsics.
RigProblem choose(const map::BundledMap& map, bool timing, const CalibrationOptions& options,
                  const feature::FeatureModel& features) {
  adjustment::Selection selection;
  const std::vector<KeyframeId> keyframes =
      choose_keyframes(usable_keyframes(map, timing), static_cast<std::size_t>(options.keyframes));
  selection.landmarks = choose_landmarks(map, keyframes, static_cast<std::size_t>(options.landmarks));
  RigProblem out{{}, groups(map, keyframes, selection.landmarks)};
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    (out.group[i] == i ? selection.fixed_keyframes : selection.free_keyframes).push_back(keyframes[i]);
  }
  out.flat = adjustment::build_problem(map, selection, features);
  out.flat.problem.twist.clear();
  for (const KeyframeId k : out.flat.keyframes) out.flat.problem.twist.push_back(map.keyframe(k).twist);
  return out;
}

// Removes the observations of a point by groups other than the one with the most observations (the first one on ties).
// Otherwise the point would connect two fixed keyframes, and their distance would constrain lengths, which the
// extrinsics have to determine.
void separate_groups(RigProblem& problem) {
  std::vector<solver::ReprojectionProblem::Observation>& observations = problem.flat.problem.observations;
  std::vector<int> count(problem.group.size());
  std::size_t kept = 0;
  for (std::size_t begin = 0, end = 0; begin < observations.size(); begin = end) {
    std::fill(count.begin(), count.end(), 0);
    const auto group_of = [&](std::size_t o) { return problem.group[static_cast<std::size_t>(observations[o].pose)]; };
    for (; end < observations.size() && observations[end].point == observations[begin].point; ++end)
      ++count[group_of(end)];
    const auto most = static_cast<std::size_t>(std::max_element(count.begin(), count.end()) - count.begin());
    for (std::size_t o = begin; o < end; ++o) {
      if (group_of(o) != most) continue;
      problem.flat.sources[kept] = problem.flat.sources[o];
      observations[kept++] = observations[o];
    }
  }
  observations.resize(kept);
  problem.flat.sources.resize(kept);
}

// Square root of the largest eigenvalue.
double largest_deviation(const Matrix3d& covariance) {
  return std::sqrt(
      Eigen::SelfAdjointEigenSolver<Matrix3d>(covariance, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff());
}

double mahalanobis_distance(const Vector3d& change, const Matrix3d& covariance) {
  return std::sqrt(change.dot(covariance.llt().solve(change)));
}

std::vector<ParameterRefinement> evaluate_intrinsics(const solver::CameraEstimate& estimate,
                                                     const camera::CameraModel& model) {
  std::vector<ParameterRefinement> out;
  for (const std::string& name : camera::parameter_names(model)) {
    const auto k = static_cast<Eigen::Index>(out.size());
    out.push_back(
        {name, estimate.intrinsics_change(k), estimate.intrinsics_sigma(k), estimate.intrinsics_observed[out.size()]});
  }
  return out;
}

void evaluate_extrinsics(const solver::CameraEstimate& estimate, const CalibrationOptions& options,
                         CameraRefinement& out) {
  const Vector3d rotation = estimate.change.head<3>(), translation = estimate.change.tail<3>();
  const Matrix3d rotation_covariance = estimate.covariance.topLeftCorner<3, 3>(),
                 translation_covariance = estimate.covariance.bottomRightCorner<3, 3>();
  out.change_deg = geometry::degrees(rotation.norm());
  out.change_mm = translation.norm() * kMillimetres;
  out.std_deg = geometry::degrees(largest_deviation(rotation_covariance));
  out.std_mm = largest_deviation(translation_covariance) * kMillimetres;
  out.rotation_sigmas = mahalanobis_distance(rotation, rotation_covariance);
  out.translation_sigmas = mahalanobis_distance(translation, translation_covariance);
  out.suspect = (out.rotation_sigmas > options.suspect_sigmas && out.change_deg > options.suspect_deg) ||
                (out.translation_sigmas > options.suspect_sigmas && out.change_mm > options.suspect_mm);
}

// Returns true if no extrinsics have moved from `before` by more than their own uncertainty.
bool converged(const solver::RigAdjustment& adjusted, const solver::RigValues& before) {
  for (std::size_t c = 1; c < before.T_cam_rig.size(); ++c) {
    const geometry::Vector6d change = solver::extrinsic_change(adjusted.values.T_cam_rig[c], before.T_cam_rig[c]);
    if (change.dot(adjusted.cameras[c].covariance.llt().solve(change)) > static_cast<double>(change.size()))
      return false;
  }
  return true;
}

// Adjusts again with the variance of each landmark (adjustment/landmark_noise.h), from the estimate `from`.
solver::RigAdjustment adjust_weighted(const solver::RigAdjustmentOptions& options, solver::RigAdjustment from,
                                      RigProblem& problem, const std::stop_token& stop) {
  solver::ReprojectionProblem& flat = problem.flat.problem;
  const auto chi2 = solver::squared_errors(flat, flat.T_rig_world, flat.points, from.values);
  adjustment::apply_variances(adjustment::landmark_variances(flat, chi2, solver::beyond(chi2, solver::kChi2TwoDof95)),
                              flat);
  solver::RigAdjustment out = solver::adjust_rig(flat, options, from.values, stop);
  if (!out.done) return from;
  out.scale_change *= from.scale_change;
  return out;
}

// A map built with a wrong calibration contains mostly the observations that agree with it, so adjusting it once stops
// short of the truth. Therefore the rejected observations are searched again with the new calibration.
solver::RigAdjustment adjust_in_passes(const map::BundledMap& map, const feature::FeatureModel& features,
                                       const solver::RigAdjustmentOptions& options, RigProblem& problem,
                                       const std::stop_token& stop) {
  solver::RigValues before = solver::RigValues::of(map.rig());
  separate_groups(problem);
  solver::RigAdjustment out = solver::adjust_rig(problem.flat.problem, options, before, stop);
  for (int pass = 1; pass < kPasses && out.done && !converged(out, before); ++pass) {
    before = out.values;
    if (recover_observations(map, before.applied_to(map.rig()), features, problem.flat) == 0) break;
    separate_groups(problem);
    solver::RigAdjustment again = solver::adjust_rig(problem.flat.problem, options, before, stop);
    if (!again.done) break;
    again.scale_change *= out.scale_change;
    out = std::move(again);
  }
  return out.done ? adjust_weighted(options, std::move(out), problem, stop) : out;
}

solver::RigAdjustmentOptions prior_of(const camera::Rig& rig, const CalibrationOptions& options) {
  solver::RigAdjustmentOptions out{.sigma_rotation = geometry::radians(options.sigma_rotation_deg),
                                   .sigma_translation = options.sigma_translation_mm / kMillimetres,
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

// `rig` with the time offsets of the capture times of a map.
camera::Rig with_time_offsets_of(const camera::Rig& of_map, const camera::Rig& rig) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
    cameras.back().camera.time_offset_ns = of_map.camera(c).time_offset_ns;
  }
  return camera::Rig(std::move(cameras));
}

// The prior of all times, which refer to the capture times of the map.
std::vector<solver::TimingPrior> timing_prior(const camera::Rig& of_map, const camera::Rig& calibrated,
                                              const CalibrationOptions& options) {
  std::vector<solver::TimingPrior> out;
  for (std::size_t c = 0; c < calibrated.size(); ++c) {
    const camera::Camera& camera = calibrated.camera(c);
    const double shift_s = to_seconds(camera.time_offset_ns - of_map.camera(c).time_offset_ns);
    out.push_back({{shift_s, camera.readout_s},
                   c == 0 ? 0.0 : options.sigma_time_offset_ms / kMilliseconds,
                   options.sigma_readout_ms / kMilliseconds});
  }
  return out;
}

// Whether a time changed by more than its uncertainty and than what matters.
bool significant(double change_s, double sigma_s, const CalibrationOptions& options) {
  return std::abs(change_s) > std::max(options.suspect_sigmas * sigma_s, options.suspect_ms / kMilliseconds);
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
  solver::RigAdjustmentOptions with_timing = prior_of(reference, options);
  with_timing.timing = timing;
  const auto adjusted = solver::adjust_rig(problem.flat.problem, with_timing, solver::RigValues::of(map.rig()), stop);
  if (!adjusted.done) return {};
  bool any = false;
  for (std::size_t c = 0; c < timing.size(); ++c) {
    const solver::CameraEstimate& estimate = adjusted.cameras[c];
    if (!significant(estimate.timing_change.shift_s, estimate.timing_sigma.shift_s, options)) timing[c].sigma_shift = 0;
    if (!significant(estimate.timing_change.readout_s, estimate.timing_sigma.readout_s, options))
      timing[c].sigma_readout = 0;
    any |= timing[c].sigma_shift > 0 || timing[c].sigma_readout > 0;
  }
  return any ? timing : std::vector<solver::TimingPrior>{};
}

void evaluate_timing(const solver::CameraEstimate& estimate, CameraRefinement& out) {
  const auto in_ms = [](double change_s, double sigma_s) {
    return TimeRefinement{kMilliseconds * change_s, kMilliseconds * sigma_s, sigma_s > 0};
  };
  out.time_offset = in_ms(estimate.timing_change.shift_s, estimate.timing_sigma.shift_s);
  out.readout = in_ms(estimate.timing_change.readout_s, estimate.timing_sigma.readout_s);
}

map::SetPoses poses_of(const adjustment::BundleProblem& flat) {
  map::SetPoses out;
  for (std::size_t i = 0; i < flat.keyframes.size(); ++i) {
    if (flat.problem.pose_free[i] != 0) out.keyframes.emplace_back(flat.keyframes[i], flat.problem.T_rig_world[i]);
  }
  for (std::size_t i = 0; i < flat.landmarks.size(); ++i) {
    if (flat.problem.points[i].allFinite()) out.landmarks.emplace_back(flat.landmarks[i], flat.problem.points[i]);
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

RigRefinement refine_rig(const map::BundledMap& map, const camera::Rig& calibrated, const CalibrationOptions& options,
                         const feature::FeatureModel& features, std::stop_token stop) {
  RigRefinement out;
  // Without metric scale, calibration errors in millimetres have no meaning in the map.
  if (map.rig().size() < 2 || map.num_keyframes() == 0 || map.scale() != map::Scale::kMetric) return out;
  const camera::Rig reference = with_time_offsets_of(map.rig(), calibrated);
  solver::RigAdjustmentOptions prior = prior_of(calibrated, options);
  prior.timing =
      contradicted_timing(map, reference, timing_prior(map.rig(), calibrated, options), options, features, stop);
  RigProblem problem = choose(map, !prior.timing.empty(), options, features);
  problem.flat.problem.rig = &reference;
  out.keyframes = problem.flat.keyframes.size();
  out.landmarks = problem.flat.landmarks.size();
  const solver::RigAdjustment adjusted = adjust_in_passes(map, features, prior, problem, stop);
  if (!adjusted.done) return out;
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
  out.scale_change = adjusted.scale_change;
  out.rig = adjusted.values.applied_to(reference);
  out.poses = poses_of(problem.flat);
  return out;
}

bool accepted(const RigRefinement& refinement, const CalibrationOptions& options) {
  if (!refinement.done || options.refine == Refine::kFalse) return false;
  return options.refine == Refine::kTrue || refinement.verdict == Verdict::kInconsistent;
}

std::optional<RigRefinement> refine_if_accepted(const map::BundledMap& map, const camera::Rig& calibrated,
                                                const CalibrationOptions& options,
                                                const feature::FeatureModel& features, const std::stop_token& stop) {
  if (options.refine == Refine::kFalse) return std::nullopt;
  if (options.refine == Refine::kAuto) {
    if (!accepted(refine_rig(map, calibrated, quick(options), features, stop), options)) return std::nullopt;
  }
  RigRefinement out = refine_rig(map, calibrated, options, features, stop);
  return accepted(out, options) ? std::optional(std::move(out)) : std::nullopt;
}

void move_submap(KeyframeId keyframe, const geometry::SE3& T_rig_world, map::MapDraft& draft) {
  const map::BundledMap& map = draft.map();
  const geometry::SE3 T_new_old = T_rig_world.inverse() * map.keyframe(keyframe).T_rig_world,
                      T_old_new = T_new_old.inverse();
  const KeyframeId root = map.root_of(keyframe);
  map::SetPoses poses{.keyframes = {}, .landmarks = {}, .correction = true};
  for (const KeyframeId k : map.keyframes_of_submap(root))
    poses.keyframes.emplace_back(k, map.keyframe(k).T_rig_world * T_old_new);
  for (const LandmarkId l : map.landmark_ids()) {
    if (map.root_of(map.landmark(l).reference.keyframe) == root)
      poses.landmarks.emplace_back(l, T_new_old * map.landmark(l).position);
  }
  draft.set_poses(std::move(poses));
}

void apply(const RigRefinement& refinement, map::MapDraft& draft) {
  for (const KeyframeId root : draft.map().roots()) draft.scale_submap(root, refinement.scale_change);
  draft.set_rig(*refinement.rig);
  draft.set_poses(refinement.poses);
}

}  // namespace bslam::calibration
