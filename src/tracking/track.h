// Tracking: the pose of camera 0 for each frame, from all cameras, against an immutable version of the map.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "base/random.h"
#include "map/anchored_pose.h"
#include "map/map_edit.h"
#include "tracking/camera_consensus.h"
#include "tracking/frame_matches.h"

namespace bslam::tracking {

inline constexpr double kMaxPrediction_s = 0.5;  // between frames: the motion says nothing farther ahead

enum class TrackStatus { kNotStarted, kTracking, kLost };

// Why a frame has no pose. A frame whose pose is not supported is lost, never guessed.
enum class LostReason {
  kNone,
  kNotStarted,
  kNoImages,
  kFewFeatures,
  kFewMatches,
  kFewInliers,
  kUnstablePose,
  kNotFound
};

std::string_view describe(LostReason reason);

struct CameraCounts {
  int keypoints = 0, matched = 0, inliers = 0;
  bool doubted = false;  // it delivered a picture, but not of what the rig sees there
};

struct TrackResult {
  FrameId frame;
  TimeNs time_ns = 0;
  TrackStatus status = TrackStatus::kNotStarted;
  LostReason reason = LostReason::kNotStarted;
  geometry::SE3 T_rig_world;   // meaningful while tracking
  map::AnchoredPose anchored;  // the same pose, such that corrections of the map apply to it; no pose unless tracking
  // Covariance of the pose, as a perturbation delta of T_rig_world = exp(delta) T_rig_world: rotation (rad) first, then
  // translation (map units). From the keypoints of this frame with the landmarks held fixed. Empty where the pose was
  // not estimated from the map: in a frame that started a map, or was located at the end of the run.
  std::optional<geometry::Matrix6d> covariance;
  std::vector<CameraCounts> cameras;
};

// What the tracker carries from frame to frame; a value.
struct TrackerState {
  TrackStatus status = TrackStatus::kNotStarted;
  TimeNs time_ns = 0;                       // of the last tracked frame
  map::AnchoredPose anchored;               // pose of the last tracked frame
  std::optional<geometry::Vector6d> twist;  // T_rig_world(t + dt) = exp(dt twist) T_rig_world(t); rad/s, m/s
  double twist_interval_s = 0;              // time between the two frames from which the twist was computed
  std::vector<LandmarkId> landmarks;        // inliers of the last tracked frame
  std::vector<CameraTrust> cameras;         // empty as long as no frame was tracked
  int frames_since_keyframe = 0;
  int best_overlap = 0;  // most landmarks of the reference found in a frame since it was made
  std::vector<map::VisibilityCount> visibility_counts;  // not yet folded into the map
};

// Per camera: it contradicts the others or has seen nothing again, and waits to be believed anew.
std::vector<std::uint8_t> doubted(const TrackerState& state, std::size_t cameras);

struct TrackOutput {
  TrackResult result;
  TrackerState state;
  FrameMatches matches;  // inliers
  // The frame as tracking leaves it: keypoints of the inliers aligned to their landmarks, the velocity of the rig as
  // estimated, cameras that are not trusted without keypoints. Empty where the frame has no pose.
  frame::BundledFrame frame;
  bool keyframe_due = false;
};

struct TrackInput {
  const map::BundledMap& map;
  std::span<const image::Pyramid> pyramids;               // per camera
  std::span<const matching::AlignmentOptions> alignment;  // per camera
  const TrackerState& state;
  feature::FeatureModel features = {};
  std::uint64_t seed = 1;
};

// Finds the pose of `frame`. The map has at least one keyframe.
TrackOutput track(const TrackInput& input, const frame::BundledFrame& frame, const TrackingOptions& options,
                  ThreadPool& pool);

// A frame without a pose, and the state after it.
TrackOutput lost(const TrackerState& state, const frame::BundledFrame& frame, LostReason reason);

// The state from which tracking goes on after `keyframe` was made of a frame at `T_rig_world` that shows `landmarks`.
TrackerState state_at_keyframe(const TrackerState& before, TimeNs time_ns, KeyframeId keyframe,
                               std::vector<LandmarkId> landmarks);

}  // namespace bslam::tracking
