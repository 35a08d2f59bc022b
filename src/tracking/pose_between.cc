#include "tracking/pose_between.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "map/keyframe_landmarks.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;

std::vector<LandmarkId> landmarks_of_either(const map::BundledMap& map, KeyframeId a, KeyframeId b) {
  std::vector<LandmarkId> out;
  std::ranges::set_union(map::landmarks_of(map, a), map::landmarks_of(map, b), std::back_inserter(out));
  return out;
}

TrackResult result_at(const map::BundledMap& map, const frame::BundledFrame& frame, const SE3& T_rig_world,
                      KeyframeId reference) {
  TrackResult out;
  out.frame = frame.id;
  out.time_ns = frame.time_ns;
  out.status = TrackStatus::kTracking;
  out.reason = LostReason::kNone;
  out.T_rig_world = T_rig_world;
  out.anchored = map::AnchoredPose::at(map, reference, T_rig_world);
  for (const frame::CameraFrame& c : frame.cameras)
    out.cameras.push_back({.keypoints = static_cast<int>(c.keypoints.size())});
  return out;
}

}  // namespace

std::optional<TrackResult> pose_between(const map::BundledMap& map, const BetweenKeyframes& early,
                                        const feature::FeatureModel& features, const TrackingOptions& options,
                                        ThreadPool& pool) {
  const KeyframeId before = map.nearest_alive_ancestor(early.before), after = map.nearest_alive_ancestor(early.after);
  if (!before.valid() || !after.valid()) return std::nullopt;
  frame::BundledFrame frame = *early.frame;
  if (frame::changes_frames(*early.rig, map.rig()))
    frame = frame::recalibrated(std::move(frame), *early.rig, map.rig());
  const SE3 T_before = map.resolved_pose(early.before), T_after = map.resolved_pose(early.after);
  if (frame.time_ns == early.before_ns) return result_at(map, frame, T_before, before);
  const double between_s = to_seconds(early.after_ns - early.before_ns);
  const double fraction = to_seconds(frame.time_ns - early.before_ns) / between_s;
  frame.twist = (T_after * T_before.inverse()).log() / between_s;
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  SE3 T = geometry::interpolate(T_before, T_after, fraction);
  const std::vector<LandmarkId> landmarks = landmarks_of_either(map, before, after);
  // The first search uses the interpolated pose, the second one the pose found by the first.
  solver::PoseSolution solution;
  FrameMatches found;
  for (const double radius : {options.matching.predicted_radius, options.matching.local_radius}) {
    found = find_landmarks(map, frame, T, landmarks, {},
                           {.radius = radius,
                            .max_hamming = options.matching.max_hamming,
                            .ratio = options.matching.ratio,
                            .scale_factor = features.pyramid.scale_factor},
                           pool)
                .found;
    solution = solver::solve_pose(rig, pose_observations(map, frame, found, features), T, options.pose);
    const auto needed = options.min_inlier_ratio * static_cast<double>(count(found));
    if (!solution.ok || solution.num_inliers < options.min_inliers || solution.num_inliers < needed)
      return std::nullopt;
    T = solution.T_rig_world;
  }
  TrackResult out = result_at(map, frame, T, before);
  for (std::size_t c = 0; c < found.size(); ++c) {
    out.cameras[c].matched = static_cast<int>(found[c].size());
    out.cameras[c].inliers = solution.inliers_per_camera[c];
  }
  return out;
}

}  // namespace bslam::tracking
