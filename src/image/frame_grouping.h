// Which images of different cameras make one frame, told from their times alone. Recorded data sets are grouped whole;
// live images by the same rule over what has arrived.
#pragma once

#include <span>
#include <vector>

#include "base/timestamp.h"

namespace bslam::image {

struct GroupedFrame {
  TimeNs time_ns = 0;       // of camera 0's image, or of the earliest where that is missing
  std::vector<int> images;  // per camera: position in its list of times; -1 = none
};

struct FrameGroups {
  std::vector<GroupedFrame> frames;      // in order of time
  std::vector<int> shared_with_camera0;  // per camera: images in a frame that has an image of camera 0
  std::vector<int> unassigned;           // per camera: images in no frame
};

// Frames are the instants of camera 0. An image of another camera joins the nearest of them within `tolerance_ns`; of
// two images of one camera the nearer stays. Where camera 0 has a gap, the others make frames of their own: an image
// more than `gap_ns` away from any image of camera 0, with those of other cameras within the tolerance after it. Images
// that lie near an instant of camera 0 but not within the tolerance belong to no frame, so that cameras which do not
// fire together never double the frame rate. `times[i]`: of camera i's images, strictly increasing; any may be empty.
FrameGroups group_frames(std::span<const std::vector<TimeNs>> times, TimeNs tolerance_ns, TimeNs gap_ns);

// Distance from camera 0's images beyond which it has a gap: 3/4 of the interval between them, no less than the
// tolerance.
TimeNs gap_after(TimeNs interval_ns, TimeNs tolerance_ns);

// Median of the intervals between neighbouring times, the lower of two in the middle; 0 for fewer than two times.
TimeNs median_interval(std::span<const TimeNs> times);

}  // namespace bslam::image
