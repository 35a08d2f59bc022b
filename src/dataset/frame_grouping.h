// Groups images of different cameras into frames by time.
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

// Every image of camera 0 starts a frame. An image of another camera is added to the frame closest in time if that is
// within `tolerance_ns`; if two images of a camera compete for a frame, the closer one is kept. In gaps of camera 0 the
// other cameras form frames of their own: these start with an image that is more than 3/4 of the median interval of
// camera 0 away from any of its images, and contain the images of other cameras within the tolerance after it. All
// other images belong to no frame, so that unsynchronised cameras never double the frame rate. `images[i]` are the
// images of camera i, strictly increasing in time. Camera 0 must have at least one.
FrameGrouping group_frames(std::span<const std::vector<image_files::ImageFile>> images, TimeNs tolerance_ns);

}  // namespace bslam::dataset
