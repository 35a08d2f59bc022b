#include "tracking/keyframe_decision.h"

#include <algorithm>

#include "base/median.h"
#include "geometry/triangulation.h"
#include "tracking/make_keyframe.h"

namespace bslam::tracking {
namespace {

constexpr int kFewMatchedTracked = 100,
              kManyMatchedFree = 70;     // features; the rule of ORB-SLAM2's paper for near points
constexpr double kStillParallax = 0.01;  // radians: less is a rig at rest
constexpr double kStillOverlap = 0.95;
constexpr int kStarvedInterval = 8;  // frames: a camera that sees nothing new may not ask all the time

bool fresh_depth(const frame::BundledFrame& frame, const FrameMatches& inliers, const InitialisationOptions& options) {
  std::vector<std::uint8_t> tracked(frame.bundled.size(), 0);
  for (std::size_t c = 0; c < inliers.size(); ++c) {
    for (const Match& m : inliers[c]) tracked[frame.bundled.feature(CameraIndex(c), m.keypoint).index()] = 1;
  }
  int with = 0, without = 0;
  for (std::size_t f = 0; f < frame.bundled.num_matched(); ++f) {
    if (!has_sound_depth(frame.bundled.point(FeatureId(f)), options)) continue;
    ++(tracked[f] ? with : without);
  }
  return with < kFewMatchedTracked && without > kManyMatchedFree;
}

}  // namespace

KeyframeEvidence keyframe_evidence(const map::BundledMap& map, const frame::BundledFrame& frame,
                                   const FrameMatches& inliers, KeyframeId reference, const geometry::SE3& T_rig_world,
                                   const TrackingOptions& options) {
  KeyframeEvidence evidence;
  const Eigen::Vector3d centre_now = T_rig_world.inverse().translation();
  const Eigen::Vector3d centre_then = map.resolved_pose(reference).inverse().translation();
  std::vector<double> parallaxes;
  for (const LandmarkId l : landmarks_of(inliers)) {
    const auto observations = map.observations(l);
    const bool shared = std::any_of(observations.begin(), observations.end(),
                                    [&](const map::Observation& o) { return o.keyframe == reference; });
    if (!shared) continue;
    const Eigen::Vector3d& p = map.landmark(l).position;
    parallaxes.push_back(geometry::angle_between(p - centre_now, p - centre_then));
  }
  evidence.overlap = static_cast<int>(parallaxes.size());
  if (!parallaxes.empty()) evidence.parallax = median(std::move(parallaxes));
  for (std::size_t c = 0; c < inliers.size(); ++c) {
    const auto keypoints = static_cast<double>(frame.cameras[c].keypoints.size());
    const auto found = static_cast<double>(inliers[c].size());
    evidence.starved |= found < options.keyframe.starved_camera && found < options.keyframe.starved_share * keypoints;
  }
  evidence.fresh_depth = fresh_depth(frame, inliers, options.initialisation);
  return evidence;
}

bool keyframe_due(const KeyframeEvidence& e, const KeyframeOptions& options) {
  if (e.frames_since_keyframe < options.min_interval) return false;
  const double overlap = static_cast<double>(e.overlap) / std::max(1, e.best_overlap);
  if (overlap < options.min_overlap || e.parallax > options.max_parallax || e.fresh_depth) return true;
  const bool still = e.parallax < kStillParallax && overlap > kStillOverlap;
  if (e.starved && e.frames_since_keyframe >= kStarvedInterval && !still) return true;
  return e.frames_since_keyframe >= options.max_interval && !still;
}

}  // namespace bslam::tracking
