// The result of one input frame, used by the callers of the system, the summary and the plots.
#pragma once

#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "tracking/camera_status.h"
#include "tracking/track.h"

namespace bslam::tracking {

struct StageTime {
  std::string_view stage;  // must be a string literal
  double ms = 0;
};

// A lost rig was relocalised in the map.
struct Relocalisation {
  KeyframeId matched_keyframe;
  int inliers = 0;  // keypoints
};

// A keyframe that was created in the background from an earlier frame, after that frame had been processed.
struct CreatedKeyframe {
  FrameId frame;
  KeyframeId keyframe;
  friend bool operator==(const CreatedKeyframe&, const CreatedKeyframe&) = default;
};

struct FrameRecord {
  TrackResult result;  // result returned when the frame was processed
  // The result found at the end of the run for a frame that had no pose when it was processed; else null.
  std::shared_ptr<const TrackResult> found_later;
  std::vector<image::ImageState> images;  // per camera
  std::vector<CameraStatus> cameras;      // per camera
  std::optional<Relocalisation> relocalisation;
  // Velocity of the rig: T_rig_world(t + dt) = exp(dt twist) T_rig_world(t); angular (rad/s) first, then linear (map
  // units/s). Empty in frames without a pose and in the first frame with one.
  std::optional<geometry::Vector6d> twist;
  // The odometry pose T_rig_odom (REP 105) is the accumulated motion of the rig. Corrections of the map change
  // T_map_odom only. The odometry pose does not change while the rig is lost. T_rig_odom = T_rig_world * T_map_odom,
  // with T_rig_world of `result`.
  geometry::SE3 T_rig_odom, T_map_odom;
  KeyframeId root;                         // root keyframe of the submap in whose world frame `result` gives the pose
  map::Scale scale = map::Scale::kMetric;  // scale of the map in which `result` gives the pose
  bool keyframe = false;
  // Keyframe created in the background, used by tracking for the first time in this frame.
  std::optional<CreatedKeyframe> created;
  bool direct = false;         // the pose was found by direct tracking
  int reduction = 0;           // level of reduced work (tracking/reduced_work.h)
  bool recalibrated = false;   // the calibration of the rig differs from that of the previous frame
  bool map_withdrawn = false;  // the map was discarded after this frame, because its initialisation was wrong
  int unique = 0, monocular = 0, matched = 0;  // features; unique = monocular + matched

  std::vector<StageTime> stages;  // in the caller's thread
  double frame_ms = 0;            // from receiving the images to the pose

  // The final result at the end of the run.
  const TrackResult& final_result() const { return found_later ? *found_later : result; }
};

}  // namespace bslam::tracking
