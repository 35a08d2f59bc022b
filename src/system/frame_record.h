// What became of one input frame.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "tracking/camera_health.h"
#include "tracking/track.h"

namespace bslam::system {

struct StageTime {
  std::string_view stage;  // a literal
  double ms = 0;
};

// A lost rig found in the map again.
struct Relocalisation {
  KeyframeId with;
  int inliers = 0;
};

struct FrameRecord {
  tracking::TrackResult result;                      // as told to the caller
  std::optional<tracking::TrackResult> found_later;  // where it had no pose: the one it got at the end of the run
  std::vector<image::ImageState> images;
  std::vector<tracking::Outage> outages;  // per camera: why its picture was not used
  std::vector<std::uint8_t> blurred;      // per camera: out of focus or smeared, used all the same
  std::vector<std::uint8_t> waiting;  // per camera: not used, as it fires late and the motion until then was unknown
  std::optional<Relocalisation> relocalisation;
  // The smooth pose: what the motion of the rig alone adds up to. Corrections of the map change T_map_odom and never
  // this; it stands still while the rig is lost. T_rig_odom = T_rig_world * T_map_odom, with T_rig_world of `result`.
  geometry::SE3 T_rig_odom, T_map_odom;
  bool keyframe = false;
  int unique = 0, monocular = 0, matched = 0;  // features
  KeyframeId root;    // of the part of the map the pose was told in
  // Of the two, what counts in the end.
  const tracking::TrackResult& final_result() const { return found_later ? *found_later : result; }

  std::vector<StageTime> stages;  // in the caller's thread
  double frame_ms = 0;            // from handing over the images to having the pose
};

}  // namespace bslam::system
