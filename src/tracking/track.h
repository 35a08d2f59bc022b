// Tracking: the pose of camera 0 for each frame, from all cameras, against an immutable version of the map.
#pragma once

#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "base/random.h"
#include "map/anchored_pose.h"
#include "map/map_edit.h"
#include "tracking/camera_consensus.h"
#include "tracking/frame_matches.h"
#include "tracking/keyframe_decision.h"

namespace bslam::tracking {

inline constexpr double kMaxPrediction_s = 0.5;  // maximum time between frames for which the motion is predicted

enum class TrackStatus { kNotStarted, kTracking, kLost };

// The reason why a frame has no pose. A frame whose pose has too little support is lost; no predicted pose is returned.
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
  // Extracted keypoints, those matched to landmarks, and inliers; in a frame that was tracked directly: landmarks
  // searched for, aligned, and inliers.
  int keypoints = 0, matched = 0, inliers = 0;
  double squared_error_px2 = 0;  // sum of the squared reprojection errors of the inliers in the map of that time
  bool excluded = false;         // its image is not consistent with the map (tracking/camera_consensus.h)
};

// Whether another pose of a frame was supported nearly as well, because something moves (tracking/robust_pose.h).
struct MotionContest {
  // It has more than half of the support, and many landmarks in the same images agree with either of the two only: one
  // is that of moving objects, and the choice may be wrong.
  bool contested = false;
  // The same if the supports are weighted by the extents of the two motions in space: even the sizes do not tell which
  // is that of moving objects.
  bool undecided = false;

  void add(const MotionContest& other) {
    contested |= other.contested;
    undecided |= other.undecided;
  }
};

struct TrackResult {
  FrameId frame;
  TimeNs time_ns = 0;
  TrackStatus status = TrackStatus::kNotStarted;
  LostReason reason = LostReason::kNotStarted;
  geometry::SE3 T_rig_world;   // meaningful while tracking
  map::AnchoredPose anchored;  // the same pose relative to a keyframe, so that it follows corrections of the map
  // Covariance of the pose, as a perturbation delta of T_rig_world = exp(delta) T_rig_world: rotation (rad) first, then
  // translation (map units), relative to the root of the submap: the noise of the keypoints of this frame relative to
  // the map, and the covariance of the reference keyframe. Empty if the pose was not estimated by tracking: in a frame
  // that initialised a map, or was located at the end of the run.
  std::optional<geometry::Matrix6d> covariance;
  std::vector<CameraCounts> cameras;
  MotionContest contest{};
};

// Number of contested or undecided frames within this time from which on poses may be relative to moving objects.
// Single ones are usual.
inline constexpr std::size_t kContestedFrames = 5;
inline constexpr double kContestedWithin_s = 1.0;

struct LocalView;  // tracking/visible_landmarks.h

// State of direct tracking since the last frame with extracted features.
struct DirectState {
  int frames = 0;                 // number of frames tracked directly
  std::vector<int> best_inliers;  // per camera, largest number of inliers
  std::shared_ptr<const LocalView> view = {};
};

// The time offset of an image from its time stamp that a frame shows.
struct StampError {
  double offset_s = 0, variance_s2 = 0;
  TimeNs time_ns = 0;  // of the frame
};

// What the frames so far show of the errors of a camera's time stamps (tracking/stamp_errors.h).
struct StampErrors {
  double variance_s2 = 0;
  double mean_s = 0;          // of the offsets; not corrected: it is the time offset that belongs to the calibration
  int count = 0;              // number of offsets in the mean
  std::size_t reference = 0;  // camera relative to which the offsets are
  std::optional<StampError> last, before_last;
};

// State of tracking that is carried from frame to frame.
struct TrackerState {
  TrackStatus status = TrackStatus::kNotStarted;
  TimeNs time_ns = 0;          // time of the last tracked frame
  map::AnchoredPose anchored;  // pose of the last tracked frame
  // Of the last tracked frame: T_rig_world(t + dt) = exp(dt twist) T_rig_world(t); rad/s, map units/s.
  std::optional<geometry::Vector6d> twist;
  double twist_interval_s = 0;                // time between the two frames from which the twist was computed
  bool twist_kept = false;                    // it is that of the frame before, which was too shortly before
  std::vector<LandmarkId> landmarks;          // inliers of the last tracked frame
  std::vector<CameraConsensusState> cameras;  // empty until a frame was tracked
  std::vector<CameraReference> references;    // per camera
  std::vector<StampErrors> stamps;            // per camera
  DirectState direct;
  // Not yet added to the map; one for each landmark, sorted.
  std::vector<map::VisibilityCount> visibility_counts;
  // Those that a keyframe which is not yet in the map will add.
  std::vector<map::VisibilityCount> pending_counts;
};

// Per camera: whether it is excluded because it contradicted the other cameras or lost its landmarks.
std::vector<std::uint8_t> excluded(const TrackerState& state, std::size_t cameras);

struct TrackOutput {
  TrackResult result;
  TrackerState state;
  FrameMatches matches;  // inliers
  FrameMatches matched;  // including outliers
  // The refined frame: keypoints of the inliers are aligned to their landmarks, the velocity is the estimated one, and
  // excluded cameras have no keypoints. Empty if the frame has no pose.
  frame::BundledFrame frame;
  bool keyframe_due = false;
  bool at_similar_keyframe = false;  // the reference was changed to a similar keyframe, so that no new keyframe is due
};

// A pose that direct tracking found for a frame.
struct EstimatedPose {
  geometry::SE3 T_rig_world;
  bool all_cameras = true;  // every camera supports it
  // Per camera: the landmarks searched for, and the inliers among them.
  std::vector<LandmarkCounts> aligned = {};
};

struct TrackInput {
  const map::BundledMap& map;
  std::span<const image::Pyramid> pyramids;               // per camera
  std::span<const matching::AlignmentOptions> alignment;  // per camera
  const TrackerState& state;
  feature::FeatureModel features = {};
  std::uint64_t seed = 1;
  std::span<const image::ImageView> masks = {};  // per camera, an empty view if it has no mask; or empty
  std::optional<EstimatedPose> estimate = {};    // pose of this frame from direct tracking, if it was tried before
};

// Estimates the pose of `frame`. The map must have at least one keyframe.
TrackOutput track(const TrackInput& input, const frame::BundledFrame& frame, const TrackingOptions& options,
                  ThreadPool& pool);

// A frame without a pose, and the state after it.
TrackOutput lost(const TrackerState& state, const frame::BundledFrame& frame, LostReason reason);

// Mapping may have rescaled the submap since the last frame: rescales pose and velocity.
void apply_scale_change(const map::BundledMap& map, TrackerState& state);

// The state of tracking after `keyframe` was created from the frame of `time_ns`, which observes `landmarks`.
TrackerState state_at_keyframe(const TrackerState& before, TimeNs time_ns, const map::BundledMap& map,
                               KeyframeId keyframe, std::vector<LandmarkId> landmarks);

}  // namespace bslam::tracking
