// What became of one input frame.
#pragma once

#include <string_view>
#include <vector>

#include "tracking/track.h"

namespace bslam::system {

struct StageTime {
  std::string_view stage;  // a literal
  double ms = 0;
};

struct FrameRecord {
  tracking::TrackResult result;       // as told to the caller
  std::vector<image::ImageState> images;
  bool keyframe = false;
  int unique = 0, monocular = 0, matched = 0;  // features
  int map_number = 0;                 // a map that failed at its start is left behind: poses belong to one map
  std::vector<StageTime> stages;      // in the caller's thread
  double frame_ms = 0;                // from handing over the images to having the pose
};

}  // namespace bslam::system
