// The result of one frame.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "bslam/export.h"
#include "bslam/pose.h"

namespace bslam {

enum class TrackingStatus {
  kNotStarted,  // no map yet: the images need texture and, without overlapping cameras, the rig must move
  kTracking,    // the poses below are valid
  kLost         // no pose; tracking and relocalisation are attempted with every further frame
};

// The reason for which a frame has no pose.
enum class LostReason {
  kNone,          // the frame has a pose
  kNotStarted,    // there is no map yet
  kNoImages,      // no camera delivered a usable image
  kFewFeatures,   // too little texture in the images
  kFewMatches,    // too few landmarks of the map were matched
  kFewInliers,    // too few matches are consistent with a pose
  kUnstablePose,  // the images do not determine the pose
  kNotFound       // the place was not yet recognised in the loaded map
};
BSLAM_EXPORT std::string_view to_string(TrackingStatus status);  // "not-started", "tracking", "lost"
BSLAM_EXPORT std::string_view to_string(LostReason reason);      // "" for kNone

enum class CameraState {
  kOk,
  kDegraded,  // used, but with few features or reduced quality: see `reason`
  kOut        // not used for this frame: see `reason`
};
BSLAM_EXPORT std::string_view to_string(CameraState state);  // "ok", "degraded", "out"

struct CameraResult {
  CameraState state = CameraState::kOk;
  // "" if ok, otherwise no-images (for a camera that has not delivered any image yet: after ten frames), black,
  // over-exposed, frozen, inconsistent, blurred or few-features. Points to static storage.
  std::string_view reason;
  // Number of keypoints in the image. Between keyframes most frames are tracked without extracting keypoints
  // (tracking.frontend): then the number of landmarks that were searched for in the image.
  int keypoints = 0;
  int matched = 0;  // keypoints matched to landmarks of the map
  int inliers = 0;  // matched keypoints that are consistent with the pose
};

struct StageTime {
  // Points to static storage: "pyramids"; "align": landmarks are aligned directly; "extract", "bundle", "track": with
  // keypoints; "start": a map is started; "relocalise"; "results": waiting for results of other threads; "wait":
  // waiting for space in their queues.
  std::string_view stage;
  double ms = 0;  // wall time in the caller's thread
};

struct FrameResult {
  int frame = 0;             // number of frames that System::process has processed before
  std::int64_t time_ns = 0;  // time of camera 0's image, or of the earliest image if it is missing; with time offset

  TrackingStatus status = TrackingStatus::kNotStarted;
  LostReason reason = LostReason::kNotStarted;
  bool tracking() const { return status == TrackingStatus::kTracking; }

  // The pose in the map; identity unless tracking. The world frame is the frame of camera 0 at the start of the submap:
  // x right, y down, z forward, so that T_world_body begins with the pose of the body in camera 0; gravity is not
  // known. The pose jumps when a loop is closed. Poses of different submaps are unrelated; after submaps were merged,
  // `submap` of later frames may differ for the same place. Camera 0 is the one that was calibrated: a refinement of
  // the calibration may turn it in the body, so that T_world_cam0 then differs from that of MapView::Keyframe. The pose
  // of a camera that belongs to MapView::rig() is T_world_body * rig().camera(i).T_body_cam.
  Pose T_world_cam0, T_world_body;
  // Scale of the map, which determines the unit of length of all poses and velocities. Valid if tracking.
  Scale scale = Scale::kMetric;
  int submap = -1;  // the submap of these poses: id of its first keyframe, its root
  // Covariance of T_world_cam0, if known: of the small motion d, rotation first, in the axes of camera 0, with
  // T_world_cam0(true) = T_world_cam0 exp(d). Relative to the first keyframe of the submap, or to a loaded map: image
  // noise, the drift of the map and, if the calibration was estimated from the images, its remaining error, such as
  // that of the scale of the baselines. A given calibration is taken as exact after the images of about eight keyframes
  // have not contradicted it, or if calibration.refine is false; until then, the covariance contains the error that it
  // may have. The standard deviations of the position of camera 0 along its own axes are the square roots of elements
  // 21, 28 and 35. Nullopt in the first frame of a map. That of T_world_body in the axes of the body is A covariance
  // A^T with the adjoint A of T_body_cam0.
  std::optional<Covariance6> covariance;
  // Velocity of the body frame in its own axes, averaged since the previous frame; nullopt if that frame has no pose or
  // was more than half a second earlier.
  std::optional<Velocity> velocity;

  // The odometry pose (the `odom` frame of ROS REP 105): continuous, since corrections of the map do not change it, and
  // constant while the rig is lost. For control and local planning. T_world_cam0 = T_map_odom * T_odom_cam0, where
  // `map` denotes the same frame as `world`.
  Pose T_odom_cam0, T_odom_body, T_map_odom;

  std::vector<CameraResult> cameras;  // one per camera of the rig
  int unique_features = 0;            // number of features of all cameras; features matched between cameras count once
  int matched_features = 0;           // unique features observed by several cameras

  // The frame became a keyframe. A frame can also become a keyframe after its call of System::process has returned;
  // Callbacks::keyframe reports that.
  bool keyframe = false;
  int keyframe_id = -1;      // its id if it became a keyframe, otherwise the reference keyframe; -1 if none
  bool relocalised = false;  // tracking was recovered by place recognition
  // Two motions explain the images almost equally well, such as those of the scene and of people who fill the view. The
  // pose may be relative to the wrong one if this is true for several frames within a second.
  bool contested = false;
  // The initial map was wrong: it was up to scale, and the rig was lost in it soon after, or the cameras that determine
  // its scale contradicted it, or its poses were contested. All poses and keyframes reported so far are invalid, and
  // the map is empty. A new one will be initialised; ids of keyframes are not used again.
  bool map_withdrawn = false;

  std::vector<StageTime> stages;
  double total_ms = 0;  // wall time from the call of System::process to the pose
};

}  // namespace bslam
