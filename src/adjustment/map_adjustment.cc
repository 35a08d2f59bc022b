#include "adjustment/map_adjustment.h"

#include <algorithm>
#include <cmath>

#include "adjustment/landmark_noise.h"
#include "adjustment/pose_uncertainty.h"

namespace bslam::adjustment {
namespace {

using solver::ReprojectionProblem;

// Converts `bound`, an upper bound of the squared error of one keypoint, to the equally improbable bound of the sum
// over `keypoints` keypoints (Wilson-Hilferty approximation, scaled to be exact for one keypoint).
double sum_bound(double bound, int keypoints) {
  const auto quantile = [](double degrees) {
    const double v = 2.0 / (9.0 * degrees), root = 1.0 - v + 1.645 * std::sqrt(v);
    return degrees * root * root * root;
  };
  return bound * quantile(2.0 * keypoints) / quantile(2.0);
}

// Outliers are classified per observation, that is for all keypoints of a feature together. If keypoints were
// classified one by one, the probability that one of them exceeds its bound by chance would grow with the number of
// cameras.
std::vector<ObservationSource> outlier_observations(const BundleProblem& flat, double bound) {
  const std::vector<double> chi2 = solver::squared_errors(flat.problem);
  std::vector<ObservationSource> bad;
  for (std::size_t i = 0; i < chi2.size();) {
    const ObservationSource source = flat.sources[i];
    double sum = 0;
    int keypoints = 0;
    for (;
         i < chi2.size() && flat.sources[i].landmark == source.landmark && flat.sources[i].keyframe == source.keyframe;
         ++i) {
      sum += chi2[i];
      ++keypoints;
    }
    if (!(sum <= sum_bound(bound, keypoints))) bad.push_back(source);
  }
  return bad;
}

// Landmarks observed by one keyframe only are not part of the problem; they keep their position relative to that
// keyframe.
void move_single_view_landmarks(const map::BundledMap& map, KeyframeId k, const geometry::SE3& T_rig_world,
                                map::SetPoses& poses) {
  const geometry::SE3 T_new_old = T_rig_world.inverse() * map.keyframe(k).T_rig_world;
  for (const LandmarkId l : map.keyframe(k).landmarks) {
    if (!l.valid() || map.observations(l).size() != 1) continue;
    poses.landmarks.emplace_back(l, T_new_old * map.landmark(l).position);
  }
}

map::SetPoses poses_of(const map::BundledMap& map, const BundleProblem& flat) {
  map::SetPoses poses;
  for (std::size_t i = 0; i < flat.keyframes.size(); ++i) {
    if (!flat.problem.pose_free[i]) continue;
    poses.keyframes.emplace_back(flat.keyframes[i], flat.problem.T_rig_world[i]);
    move_single_view_landmarks(map, flat.keyframes[i], flat.problem.T_rig_world[i], poses);
  }
  for (std::size_t i = 0; i < flat.landmarks.size(); ++i) {
    if (flat.problem.points[i].allFinite()) poses.landmarks.emplace_back(flat.landmarks[i], flat.problem.points[i]);
  }
  return poses;
}

// The round without robust kernel, on the inliers, with a variance for each landmark. Returns the uncertainties
// requested by the selection.
PoseUncertainties adjust_inliers(const map::BundledMap& map, const Selection& selection,
                                 const AdjustmentOptions& options, BundleProblem& flat, std::stop_token stop) {
  const std::vector<double> chi2 = solver::squared_errors(flat.problem);
  const auto skip = solver::beyond(chi2, options.outlier_chi2);
  const auto variances = landmark_variances(flat.problem, chi2, skip);
  solver::BundleOptions solve{.iterations = options.final_iterations,
                              .relative_decrease = options.relative_decrease,
                              .robust = false,
                              .marginals = poses_with_uncertainty(selection, flat),
                              .rig_deviation = map.rig_deviation(),
                              .rig_prior = selection.rig_prior,
                              .correlated_observations = options.correlated_observations};
  if (solve.rig_deviation && !selection.whole_map)  // the whole map is fixed by the roots, which have no effects
    solve.fixed_effects = fixed_effects(map, flat, solve.rig_deviation->cols());
  const auto summary = adjust_with_variances(flat.problem, variances, solve, skip, std::move(stop));
  PoseUncertainties out;
  if (!solve.rig_deviation && !solve.rig_prior) out = without_calibration(map);
  for (auto& entry :
       pose_uncertainties(map, flat, solve.marginals, summary.uncertainties, options.correlated_observations))
    out.push_back(std::move(entry));
  return out;
}

}  // namespace

AdjustmentReport adjust_map(const Selection& selection, const AdjustmentOptions& options,
                            const feature::FeatureModel& features, map::MapDraft& draft, std::stop_token stop) {
  AdjustmentReport report;
  BundleProblem flat = build_problem(draft.map(), selection, features);
  report.observations = flat.problem.observations.size();
  const bool any_fixed =
      std::any_of(flat.problem.pose_free.begin(), flat.problem.pose_free.end(), [](std::uint8_t f) { return !f; });
  if (selection.free_keyframes.empty() || !any_fixed || flat.problem.observations.empty()) return report;

  const solver::BundleOptions solve{
      .iterations = options.robust_iterations, .relative_decrease = options.relative_decrease, .robust = true};
  const auto robust = solver::adjust(flat.problem, solve, {}, stop);
  if (!robust.usable()) return report;
  report.initial_cost = robust.initial_cost;
  report.final_cost = robust.final_cost;
  PoseUncertainties uncertainties;
  if (!stop.stop_requested() && options.final_iterations > 0)
    uncertainties = adjust_inliers(draft.map(), selection, options, flat, stop);
  const std::vector<ObservationSource> bad = outlier_observations(flat, options.outlier_chi2);
  map::SetPoses poses = poses_of(draft.map(), flat);
  poses.correction = selection.whole_map;
  poses.uncertainties = std::move(uncertainties);
  std::vector<LandmarkId> touched;
  for (const auto& [landmark, position] : poses.landmarks) touched.push_back(landmark);
  draft.set_poses(std::move(poses));
  report.outliers = bad.size();
  for (const ObservationSource& s : bad) {
    if (draft.map().alive(s.landmark)) draft.remove_observation(s.landmark, s.keyframe);
  }
  std::vector<LandmarkId> moved;
  for (const LandmarkId l : touched) {
    if (draft.map().alive(l)) moved.push_back(l);
  }
  draft.refresh_landmarks(std::move(moved));
  report.done = true;
  return report;
}

}  // namespace bslam::adjustment
