#include "tracking/keyframe_decision.h"

#include <algorithm>

#include "base/median.h"
#include "geometry/triangulation.h"
#include "tracking/make_keyframe.h"

namespace bslam::tracking {
namespace {

// Close-point rule of ORB-SLAM2 (Mur-Artal & Tardos, T-RO 2017): numbers of features with accurate depth.
constexpr int kMinTrackedClose = 100, kMinUntrackedClose = 70;
constexpr double kRestMaxParallax = 0.01;  // rad; a rig at rest has a smaller parallax
constexpr double kRestMinOverlap = 0.95;
constexpr int kFewInliersInterval = 8;  // minimum number of frames between keyframes due to a camera with few inliers

bool untracked_depth(const frame::BundledFrame& frame, const FrameMatches& inliers,
                     const InitialisationOptions& options) {
  std::vector<std::uint8_t> tracked(frame.bundled.size(), 0);
  for (std::size_t c = 0; c < inliers.size(); ++c) {
    for (const Match& m : inliers[c]) tracked[frame.bundled.feature(CameraIndex(c), m.keypoint).index()] = 1;
  }
  int num_tracked = 0, num_untracked = 0;
  for (std::size_t f = 0; f < frame.bundled.num_matched(); ++f) {
    if (!has_accurate_depth(frame.bundled.point(FeatureId(f)), options)) continue;
    ++(tracked[f] ? num_tracked : num_untracked);
  }
  return num_tracked < kMinTrackedClose && num_untracked > kMinUntrackedClose;
}

bool observes(const map::BundledMap& map, KeyframeId k, LandmarkId l) {
  return std::ranges::any_of(map.observations(l), [&](const map::Observation& o) { return o.keyframe == k; });
}

}  // namespace

std::vector<int> overlap_by_camera(const map::BundledMap& map, const FrameMatches& inliers, KeyframeId reference) {
  std::vector<int> out;
  for (const std::vector<Match>& camera : inliers) {
    const auto shared =
        std::ranges::count_if(camera, [&](const Match& m) { return observes(map, reference, m.landmark); });
    out.push_back(static_cast<int>(shared));
  }
  return out;
}

KeyframeEvidence keyframe_evidence(const map::BundledMap& map, const frame::BundledFrame& frame,
                                   const FrameMatches& inliers, KeyframeId reference, const geometry::SE3& T_rig_world,
                                   const TrackingOptions& options) {
  KeyframeEvidence evidence;
  const Eigen::Vector3d centre_now = T_rig_world.inverse().translation();
  const Eigen::Vector3d centre_then = map.resolved_pose(reference).inverse().translation();
  std::vector<double> parallaxes;
  for (const LandmarkId l : landmarks_of(inliers)) {
    if (!observes(map, reference, l)) continue;
    const Eigen::Vector3d& p = map.landmark(l).position;
    parallaxes.push_back(geometry::angle_between(p - centre_now, p - centre_then));
  }
  evidence.overlap = static_cast<int>(parallaxes.size());
  if (!parallaxes.empty()) evidence.parallax = median(std::move(parallaxes));
  for (std::size_t c = 0; c < inliers.size(); ++c) {
    const auto keypoints = static_cast<double>(frame.cameras[c].keypoints.size());
    const auto found = static_cast<double>(inliers[c].size());
    evidence.camera_with_few_inliers |=
        found < options.keyframe.min_camera_inliers && found < options.keyframe.min_camera_inlier_ratio * keypoints;
  }
  evidence.untracked_depth = untracked_depth(frame, inliers, options.initialisation);
  return evidence;
}

bool keyframe_due(const KeyframeEvidence& e, const KeyframeOptions& options) {
  if (e.frames_since_keyframe < options.min_interval) return false;
  const double overlap = static_cast<double>(e.overlap) / std::max(1, e.best_overlap);
  if (overlap < options.min_overlap || e.parallax > options.max_parallax || e.untracked_depth) return true;
  const bool at_rest = e.parallax < kRestMaxParallax && overlap > kRestMinOverlap;
  if (e.camera_with_few_inliers && e.frames_since_keyframe >= kFewInliersInterval && !at_rest) return true;
  return e.frames_since_keyframe >= options.max_interval && !at_rest;
}

}  // namespace bslam::tracking
