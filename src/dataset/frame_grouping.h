// Which images of different cameras make one frame.
#pragma once

#include <span>
#include <vector>

#include "base/timestamp.h"
#include "dataset/dataset.h"

namespace bslam::dataset {

struct FrameGrouping {
  std::vector<FrameEntry> frames;        // in order of time
  std::vector<int> shared_with_camera0;  // per camera: images in a frame that has an image of camera 0
  std::vector<int> unassigned;           // per camera: images in no frame
};

// Frames are the instants of camera 0. An image of another camera joins the nearest of them within `tolerance_ns`; of
// two images of one camera the nearer stays. Where camera 0 has a gap, the others make frames of their own: an image
// more than 3/4 of camera 0's median interval away from any of its images, with those of other cameras within the
// tolerance after it. Images that lie near an instant of camera 0 but not within the tolerance belong to no frame, so
// that cameras which do not fire together never double the frame rate. `images[i]`: camera i's, strictly increasing in
// time; camera 0 has at least one.
FrameGrouping group_frames(std::span<const std::vector<image_files::ImageFile>> images, TimeNs tolerance_ns);

}  // namespace bslam::dataset
