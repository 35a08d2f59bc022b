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
  std::vector<GroupedFrame> frames;      // in order of time
  std::vector<int> shared_with_camera0;  // per camera: number of images in frames that have an image of camera 0
  std::vector<int> unassigned;           // per camera: number of images in no frame
};

// Each image of camera 0 defines a frame. An image of another camera is assigned to the nearest frame within
// `tolerance_ns`; of two images of the same camera the nearer one is kept. In a gap of camera 0 the other cameras
// define frames: an image more than `gap_ns` away from any image of camera 0, together with the images of other cameras
// within the tolerance after it. Images near an image of camera 0 but outside the tolerance belong to no frame, so that
// cameras which do not capture simultaneously never double the frame rate. `times[i]` are the times of camera i's
// images, strictly increasing; any list may be empty.
FrameGroups group_frames(std::span<const std::vector<TimeNs>> times, TimeNs tolerance_ns, TimeNs gap_ns);

// Returns the distance in time from camera 0's images beyond which camera 0 has a gap: 3/4 of the interval between its
// images, but at least the tolerance.
TimeNs gap_after(TimeNs interval_ns, TimeNs tolerance_ns);

// Returns the median interval between consecutive times, the smaller of the two middle ones for an even number, and 0
// for fewer than two times.
TimeNs median_interval(std::span<const TimeNs> times);

}  // namespace bslam::image
