// Groups images of different cameras into frames by their capture times. Recorded data sets are grouped as a whole;
// live images are grouped by the same rule among the images received so far.
#pragma once

#include <span>
#include <vector>

#include "base/timestamp.h"

namespace bslam::image {

struct GroupedFrame {
  TimeNs time_ns = 0;       // time of camera 0's image, or of the earliest image if camera 0 has none
  std::vector<int> images;  // per camera: index into its list of times; -1 if it has no image
};

struct FrameGroups {
  std::vector<GroupedFrame> frames;      // in order of time, which is strictly increasing
  std::vector<int> shared_with_camera0;  // per camera: number of images in frames that have an image of camera 0
};

// Assigns every image to exactly one frame, which has at most one image of each camera:
// 1. Each image of camera 0 defines a frame. An image of another camera joins the frame of the nearest image of camera
//    0, if that is within `tolerance_ns`; of several images of one camera the nearest joins.
// 2. The remaining images form frames among themselves. The earliest defines a frame, which the images of other cameras
//    up to `tolerance_ns` after it join, but none on the other side of an image of camera 0.
// Thus a camera that camera 0 does not accompany, because it lost images, is slower, or captures at other times, has
// frames of its own. The images of each camera are in order of time across the frames. `times[i]` are the times of
// camera i's images, strictly increasing; any list may be empty.
FrameGroups group_frames(std::span<const std::vector<TimeNs>> times, TimeNs tolerance_ns);

// Returns the median interval between consecutive times, the smaller of the two middle ones for an even number, and 0
// for fewer than two times.
TimeNs median_interval(std::span<const TimeNs> times);

}  // namespace bslam::image
