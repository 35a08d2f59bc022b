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
  // keypoints; "keyframe": the frame becomes a keyframe; "start": a map is started; "correct rig": the calibration is
  // corrected before a map is started; "relocalise"; "results": waiting for results of other threads; "wait": waiting
  // for space in their queues.
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
  // `submap` of later frames may differ for the same place. Camera 0 is RigFrame::kCamera0. Camera i of MapView::rig()
  // has the pose T_world_body * rig().camera(i).T_body_cam.
  Pose T_world_cam0, T_world_body;
  // Scale of the map, which determines the unit of length of all poses and velocities. Valid if tracking.
  Scale scale = Scale::kMetric;
  int submap = -1;  // the submap of these poses: id of its first keyframe, its root
  // Covariance C of T_world_cam0, if known: that of the right perturbation d, rotation first, in T_world_cam0(true) =
  // T_world_cam0 exp(d), in the axes of camera 0. It is relative to the root keyframe of the submap, or to a loaded
  // map. It contains the noise of the images, the drift of the map and the error that may be left in the calibration. A
  // given calibration counts as exact once the images of about eight keyframes have not contradicted it, or if
  // calibration.refine is false. The variances of the position along the axes of camera 0 are elements 21, 28 and 35.
  // The covariance of T_world_body in the axes of the body is Ad(T_body_cam0) C Ad(T_body_cam0)^T. Nullopt in the first
  // frame of a map.
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
  // A second motion, such as that of people who fill the view, has more than half of the support of the chosen one in
  // the images of the same cameras. If this is true for several frames within a second, the pose may be relative to the
  // moving objects.
  bool contested = false;
  // The initial map was wrong and was discarded: tracking was lost soon after a start without metric scale, the cameras
  // that determine the scale contradicted the map, or its landmarks supported two motions. All poses and keyframes
  // reported so far are invalid, and the map is empty. A new one will be initialised; ids of keyframes are not used
  // again.
  bool map_withdrawn = false;

  std::vector<StageTime> stages;
  double total_ms = 0;  // wall time from the call of System::process to the pose
};

}  // namespace bslam
