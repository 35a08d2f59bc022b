#include "adjustment/map_adjustment.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "adjustment/capture_times.h"
#include "adjustment/landmark_noise.h"
#include "adjustment/pose_uncertainty.h"
#include "base/median.h"

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
std::vector<ObservationSource> outlier_observations(const BundleProblem& selected, double bound) {
  const std::vector<double> chi2 = solver::squared_errors(selected.problem);
  std::vector<ObservationSource> bad;
  for (std::size_t i = 0; i < chi2.size();) {
    const ObservationSource source = selected.sources[i];
    double sum = 0;
    int keypoints = 0;
    for (; i < chi2.size() && selected.sources[i].landmark == source.landmark &&
           selected.sources[i].keyframe == source.keyframe;
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

map::SetPoses adjusted_poses(const map::BundledMap& map, const BundleProblem& selected) {
  map::SetPoses poses;
  for (std::size_t i = 0; i < selected.keyframes.size(); ++i) {
    if (!selected.problem.pose_free[i]) continue;
    poses.keyframes.emplace_back(selected.keyframes[i], selected.problem.T_rig_world[i]);
    move_single_view_landmarks(map, selected.keyframes[i], selected.problem.T_rig_world[i], poses);
  }
  for (std::size_t i = 0; i < selected.landmarks.size(); ++i) {
    if (selected.problem.points[i].allFinite())
      poses.landmarks.emplace_back(selected.landmarks[i], selected.problem.points[i]);
  }
  return poses;
}

// The factors by which the adjustment changed the lengths about keyframes: if the scale of the map is not known, the
// size of a submap of which only one keyframe is fixed is free. The factor is the median over the landmarks of the
// ratio of their distances from this keyframe. Frames that are placed relative to a keyframe follow.
std::vector<std::pair<KeyframeId, double>> scale_changes(const map::BundledMap& map, const BundleProblem& selected) {
  if (map.scale() != map::Scale::kUnobservable) return {};
  std::map<KeyframeId, std::vector<std::size_t>> poses;  // of the problem, by root
  const std::vector<KeyframeId> root = map.root_of_each();
  for (std::size_t i = 0; i < selected.keyframes.size(); ++i) poses[root[selected.keyframes[i].index()]].push_back(i);
  std::vector<std::pair<KeyframeId, double>> out;
  for (const auto& [submap, of_submap] : poses) {
    std::vector<std::size_t> fixed;
    std::ranges::copy_if(of_submap, std::back_inserter(fixed),
                         [&](std::size_t i) { return !selected.problem.pose_free[i]; });
    if (fixed.size() != 1 || of_submap.size() != map.keyframes_of_submap(submap).size()) continue;
    const Eigen::Vector3d origin = selected.problem.T_rig_world[fixed.front()].inverse().translation();
    std::vector<double> ratios;
    for (std::size_t i = 0; i < selected.landmarks.size(); ++i) {
      const map::Landmark& landmark = map.landmark(selected.landmarks[i]);
      if (root[landmark.reference.keyframe.index()] != submap) continue;
      const double ratio = (selected.problem.points[i] - origin).norm() / (landmark.position - origin).norm();
      if (std::isfinite(ratio) && ratio > 0) ratios.push_back(ratio);
    }
    if (ratios.empty()) continue;
    const double change = lower_median(std::move(ratios));
    for (const std::size_t i : of_submap) out.emplace_back(selected.keyframes[i], change);
  }
  return out;
}

// The round without robust kernel, on the inliers, with a variance for each landmark. Returns the uncertainties
// requested by the selection.
PoseUncertainties adjust_inliers(const map::BundledMap& map, const Selection& selection,
                                 const AdjustmentOptions& options, BundleProblem& selected, std::stop_token stop) {
  const std::vector<double> chi2 = solver::squared_errors(selected.problem);
  const auto skip = solver::beyond(chi2, options.outlier_chi2);
  const auto variances = landmark_variances(selected.problem, chi2, skip);
  solver::BundleOptions solve{.iterations = options.final_iterations,
                              .relative_decrease = options.relative_decrease,
                              .robust = false,
                              .marginals = poses_with_uncertainty(selection, selected),
                              .rig_deviation = map.rig_deviation(),
                              .rig_prior = selection.rig_prior,
                              .correlated_observations = options.correlated_observations};
  if (solve.rig_deviation && !selection.whole_map)  // the whole map is fixed by the roots, which have no effects
    solve.fixed_effects = fixed_effects(map, selected, solve.rig_deviation->cols());
  const auto summary = adjust_with_variances(selected.problem, variances, solve, skip, std::move(stop));
  PoseUncertainties out;
  if (!solve.rig_deviation && !solve.rig_prior) out = without_calibration(map);
  for (auto& entry :
       pose_uncertainties(map, selected, solve.marginals, summary.uncertainties, options.correlated_observations))
    out.push_back(std::move(entry));
  return out;
}

}  // namespace

bool adjust_map(const Selection& selection, const AdjustmentOptions& options, const feature::FeatureModel& features,
                map::MapDraft& draft, std::stop_token stop) {
  BundleProblem selected = build_problem(draft.map(), selection, features);
  const bool any_fixed = std::any_of(selected.problem.pose_free.begin(), selected.problem.pose_free.end(),
                                     [](std::uint8_t f) { return !f; });
  if (selection.free_keyframes.empty() || !any_fixed || selected.problem.observations.empty()) return false;

  const solver::BundleOptions solve{
      .iterations = options.robust_iterations, .relative_decrease = options.relative_decrease, .robust = true};
  const auto robust = solver::adjust(selected.problem, solve, {}, stop);
  if (!robust.usable()) return false;
  std::vector<map::CaptureTime> times = correct_capture_times(draft.map(), selected);
  PoseUncertainties uncertainties;
  if (!stop.stop_requested() && options.final_iterations > 0)
    uncertainties = adjust_inliers(draft.map(), selection, options, selected, stop);
  const std::vector<ObservationSource> bad = outlier_observations(selected, options.outlier_chi2);
  map::SetPoses poses = adjusted_poses(draft.map(), selected);
  poses.correction = selection.whole_map;
  poses.scale_changes = scale_changes(draft.map(), selected);
  poses.uncertainties = std::move(uncertainties);
  std::vector<LandmarkId> touched;
  for (const auto& [landmark, position] : poses.landmarks) touched.push_back(landmark);
  draft.set_poses(std::move(poses));
  draft.correct_times(std::move(times));
  for (const ObservationSource& s : bad) {
    if (draft.map().alive(s.landmark)) draft.remove_observation(s.landmark, s.keyframe);
  }
  std::vector<LandmarkId> moved;
  for (const LandmarkId l : touched) {
    if (draft.map().alive(l)) moved.push_back(l);
  }
  draft.refresh_landmarks(std::move(moved));
  return true;
}

}  // namespace bslam::adjustment
