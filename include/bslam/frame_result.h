// What became of one frame.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "bslam/export.h"
#include "bslam/pose.h"

namespace bslam {

enum class TrackingStatus {
  kNotStarted,  // no map yet: the rig has to see texture and, without overlapping cameras, to move
  kTracking,    // the pose below holds
  kLost         // no pose; every further frame is tried again, by place recognition as well
};

// Why a frame has no pose.
enum class LostReason {
  kNone,          // it has one
  kNotStarted,    // there is no map yet
  kNoImages,      // no camera delivered an image that can be used
  kFewFeatures,   // hardly any texture in the images
  kFewMatches,    // too few landmarks of the map found again
  kFewInliers,    // too few of those agree on a pose
  kUnstablePose,  // the images do not determine the pose
  kNotFound       // not recognised in a loaded map so far
};
BSLAM_EXPORT std::string_view to_string(TrackingStatus status);  // "not-started", "tracking", "lost"
BSLAM_EXPORT std::string_view to_string(LostReason reason);      // "" for kNone

enum class CameraState {
  kOk,
  kDegraded,  // used, but it sees little: see `reason`
  kOut        // not used for this frame: see `reason`
};
BSLAM_EXPORT std::string_view to_string(CameraState state);  // "ok", "degraded", "out"

struct CameraResult {
  CameraState state = CameraState::kOk;
  // "" while ok; no-images, black, over-exposed, frozen, inconsistent, blurred, few-features. A literal of the library.
  std::string_view reason;
  int keypoints = 0;  // found in the image
  int matched = 0;    // of these, matched to landmarks of the map
  int inliers = 0;    // of these, in agreement with the pose
};

struct StageTime {
  std::string_view stage;  // a literal of the library: "extract", "bundle", "track", ...
  double ms = 0;           // wall time in the caller's thread
};

struct FrameResult {
  int frame = 0;             // counts the calls of System::process that gave a result, from 0
  std::int64_t time_ns = 0;  // of camera 0's image, or the earliest where that is missing; with its time offset

  TrackingStatus status = TrackingStatus::kNotStarted;
  LostReason reason = LostReason::kNotStarted;
  bool tracking() const { return status == TrackingStatus::kTracking; }

  // The pose in the map, identity unless tracking. The world is camera 0 where the submap began: x right, y down, z
  // forward there. It jumps where a loop is closed. Poses of different submaps have nothing in common; later frames may
  // tell another number for the same place after submaps were merged.
  Pose T_world_cam0, T_world_body;
  Scale scale = Scale::kMetric;  // of the map then, and so the unit of length of all poses and velocities here
  int submap = -1;               // of these poses: id of the submap's first keyframe
  // The same pose's uncertainty, where it is known: of the small motion d with T_world_cam0(true) = T_world_cam0
  // exp(d), rotation first, in camera 0's axes. From image noise alone: drift of the map is not in it.
  std::optional<Covariance6> covariance;
  std::optional<Velocity> velocity;  // of the body frame, in its own axes; empty where the motion is not known

  // The smooth pose: no correction of the map touches it, and it stands still while the rig is lost. For control and
  // local planning. T_world_cam0 = T_map_odom * T_odom_cam0, with `map` another word for world.
  Pose T_odom_cam0, T_odom_body, T_map_odom;

  std::vector<CameraResult> cameras;  // one per camera of the rig
  int unique_features = 0;            // of all cameras together, those seen by several counted once
  int matched_features = 0;           // of these, seen by more than one camera

  bool keyframe = false;     // the frame became a keyframe
  int keyframe_id = -1;      // its id in the map then; else the keyframe the frame was tracked against; -1: none
  bool relocalised = false;  // found again after a loss, somewhere in the map
  // The map was a wrong start: it was up to scale, and the rig was lost in it soon after. All poses and keyframes told
  // so far are withdrawn, and the map is empty. Another one is started; ids of keyframes are not used again.
  bool map_withdrawn = false;

  std::vector<StageTime> stages;
  double total_ms = 0;  // from handing over the images to having the pose
};

}  // namespace bslam
