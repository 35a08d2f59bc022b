#include "adjustment/map_adjustment.h"

#include <algorithm>
#include <cmath>

namespace bslam::adjustment {
namespace {

using solver::ReprojectionProblem;

// Where each observation of the problem comes from in the map.
struct Source {
  LandmarkId landmark;
  KeyframeId keyframe;
};

struct FlatProblem {
  ReprojectionProblem problem;
  std::vector<KeyframeId> keyframes;  // per pose
  std::vector<LandmarkId> landmarks;  // per point
  std::vector<Source> sources;        // per observation
};

constexpr int kAbsent = -1;

// Position of each keyframe among the poses, or kAbsent.
std::vector<int> pose_positions(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<int> position(map.keyframe_slots(), kAbsent);
  for (std::size_t i = 0; i < keyframes.size(); ++i) position[keyframes[i].index()] = static_cast<int>(i);
  return position;
}

// Adds the observations of one landmark; true where two or more keyframes of the problem see it: a landmark in one alone
// says nothing about poses.
bool add_landmark(const map::BundledMap& map, LandmarkId id, const std::vector<int>& position, double sigma_px,
                  double scale_factor, FlatProblem& flat) {
  const auto observations = map.observations(id);
  const auto seen = std::count_if(observations.begin(), observations.end(), [&](const map::Observation& o) {
    return position[o.keyframe.index()] != kAbsent;
  });
  if (seen < 2) return false;
  const int point = static_cast<int>(flat.landmarks.size());
  for (const map::Observation& o : observations) {
    const int pose = position[o.keyframe.index()];
    if (pose == kAbsent) continue;
    const frame::BundledFrame& frame = *map.keyframe(o.keyframe).frame;
    for (const frame::KeypointRef r : frame.bundled.keypoints(o.feature)) {
      const feature::Keypoints& keypoints = frame.keypoints(r.camera);
      const std::size_t k = r.keypoint.index();
      const double detected = sigma_px * std::pow(scale_factor, keypoints.level[k]);
      const float sigma = o.aligned ? keypoints.sigma[k] : static_cast<float>(detected);
      flat.problem.observations.push_back({pose, point, r.camera, keypoints.pixel[k], sigma});
      flat.sources.push_back({id, o.keyframe});
    }
  }
  flat.landmarks.push_back(id);
  flat.problem.points.push_back(map.landmark(id).position);
  return true;
}

FlatProblem build(const map::BundledMap& map, const Selection& selection, double sigma_px, double scale_factor) {
  FlatProblem flat;
  flat.problem.rig = &map.rig();
  flat.keyframes = selection.free_keyframes;
  flat.keyframes.insert(flat.keyframes.end(), selection.fixed_keyframes.begin(), selection.fixed_keyframes.end());
  std::sort(flat.keyframes.begin(), flat.keyframes.end());
  for (const KeyframeId k : flat.keyframes) {
    flat.problem.T_rig_world.push_back(map.keyframe(k).T_rig_world);
    flat.problem.pose_free.push_back(std::binary_search(selection.free_keyframes.begin(), selection.free_keyframes.end(), k));
  }
  const std::vector<int> position = pose_positions(map, flat.keyframes);
  for (const LandmarkId l : selection.landmarks) add_landmark(map, l, position, sigma_px, scale_factor, flat);
  return flat;
}

std::vector<std::uint8_t> outliers(const ReprojectionProblem& problem, double max_chi2) {
  const std::vector<double> chi2 = solver::squared_errors(problem);
  std::vector<std::uint8_t> out(chi2.size());
  for (std::size_t i = 0; i < chi2.size(); ++i) out[i] = !(chi2[i] <= max_chi2);
  return out;
}

// Bound of a sum over `keypoints` keypoints that is as improbable as `bound` is for one (Wilson and Hilferty's cube root,
// scaled so that one keypoint has the bound itself).
double sum_bound(double bound, int keypoints) {
  const auto quantile = [](double degrees) {
    const double v = 2.0 / (9.0 * degrees);
    return degrees * std::pow(1.0 - v + 1.645 * std::sqrt(v), 3);
  };
  return bound * quantile(2.0 * keypoints) / quantile(2.0);
}

// An observation is a feature with all its keypoints, and is judged as a whole: the more cameras, the likelier it is that
// chance alone takes one of them over its own bound.
std::vector<Source> bad_observations(const FlatProblem& flat, double bound) {
  const std::vector<double> chi2 = solver::squared_errors(flat.problem);
  std::vector<Source> bad;
  for (std::size_t i = 0; i < chi2.size();) {
    const Source source = flat.sources[i];
    double sum = 0;
    int keypoints = 0;
    for (; i < chi2.size() && flat.sources[i].landmark == source.landmark && flat.sources[i].keyframe == source.keyframe; ++i) {
      sum += chi2[i];
      ++keypoints;
    }
    if (!(sum <= sum_bound(bound, keypoints))) bad.push_back(source);
  }
  return bad;
}

// Landmarks that one keyframe alone sees are no part of the problem: they keep their place in that keyframe.
void carry_single_views(const map::BundledMap& map, KeyframeId k, const geometry::SE3& T_rig_world, map::SetPoses& poses) {
  const geometry::SE3 T_new_old = T_rig_world.inverse() * map.keyframe(k).T_rig_world;
  for (const LandmarkId l : map.keyframe(k).landmarks) {
    if (!l.valid() || map.observations(l).size() != 1) continue;
    poses.landmarks.emplace_back(l, T_new_old * map.landmark(l).position);
  }
}

map::SetPoses poses_of(const map::BundledMap& map, const FlatProblem& flat) {
  map::SetPoses poses;
  for (std::size_t i = 0; i < flat.keyframes.size(); ++i) {
    if (!flat.problem.pose_free[i]) continue;
    poses.keyframes.emplace_back(flat.keyframes[i], flat.problem.T_rig_world[i]);
    carry_single_views(map, flat.keyframes[i], flat.problem.T_rig_world[i], poses);
  }
  for (std::size_t i = 0; i < flat.landmarks.size(); ++i) {
    if (flat.problem.points[i].allFinite()) poses.landmarks.emplace_back(flat.landmarks[i], flat.problem.points[i]);
  }
  return poses;
}

}  // namespace

AdjustmentReport adjust_map(const Selection& selection, const AdjustmentOptions& options, double sigma_px, double scale_factor,
                            map::MapDraft& draft, std::stop_token stop) {
  AdjustmentReport report;
  FlatProblem flat = build(draft.map(), selection, sigma_px, scale_factor);
  report.observations = flat.problem.observations.size();
  const bool any_fixed = std::any_of(flat.problem.pose_free.begin(), flat.problem.pose_free.end(), [](std::uint8_t f) { return !f; });
  if (selection.free_keyframes.empty() || !any_fixed || flat.problem.observations.empty()) return report;

  solver::BundleOptions solve{
      .iterations = options.robust_iterations, .relative_decrease = options.relative_decrease, .robust = true};
  const auto robust = solver::adjust(flat.problem, solve, {}, stop);
  if (!robust.usable()) return report;
  report.initial_cost = robust.initial_cost;
  report.final_cost = robust.final_cost;
  if (!stop.stop_requested() && options.final_iterations > 0) {
    const auto skip = outliers(flat.problem, options.outlier_chi2);
    solve.iterations = options.final_iterations;
    solve.robust = false;
    const auto last = solver::adjust(flat.problem, solve, skip, stop);
    if (last.usable()) report.final_cost = last.final_cost;
  }
  const std::vector<Source> bad = bad_observations(flat, options.outlier_chi2);
  map::SetPoses poses = poses_of(draft.map(), flat);
  poses.correction = selection.whole_map;
  std::vector<LandmarkId> touched;
  for (const auto& [landmark, position] : poses.landmarks) touched.push_back(landmark);
  draft.set_poses(std::move(poses));
  report.outliers = bad.size();
  for (const Source& s : bad) {
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
