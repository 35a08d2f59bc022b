// Groups the images of a recording into frames by time.
#pragma once

#include <span>
#include <vector>

#include "base/timestamp.h"
#include "dataset/dataset.h"

namespace bslam::dataset {

struct FrameGrouping {
  std::vector<FrameEntry> frames;        // in order of time
  std::vector<int> shared_with_camera0;  // per camera: number of images in frames with an image of camera 0
  std::vector<int> unassigned;           // per camera: number of images in no frame
};

// Groups images by the rule of image/frame_grouping.h. Camera 0 has a gap where two of its images are more than 3/4 of
// its median interval apart. `images[i]` are the images of camera i, strictly increasing in time. Camera 0 must have at
// least one.
FrameGrouping group_frames(std::span<const std::vector<image_files::ImageFile>> images, TimeNs tolerance_ns);

}  // namespace bslam::dataset
