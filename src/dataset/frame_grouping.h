// Which images of a recording make one frame.
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

// By the rule of image/frame_grouping.h; camera 0 has a gap where it misses more than 3/4 of its median interval.
// `images[i]`: camera i's, strictly increasing in time; camera 0 has at least one.
FrameGrouping group_frames(std::span<const std::vector<image_files::ImageFile>> images, TimeNs tolerance_ns);

}  // namespace bslam::dataset
