// Groups the images of a recording into frames by time.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/timestamp.h"
#include "dataset/dataset.h"

namespace bslam::dataset {

struct FrameGrouping {
  std::vector<FrameEntry> frames;        // in order of time
  std::vector<int> shared_with_camera0;  // per camera: number of images in frames with an image of camera 0
  // Per camera: number of images that are in no frame of camera 0 although camera 0 was capturing: one of its images is
  // less than 3/4 of its median interval away.
  std::vector<int> beside_camera0;
  TimeNs tolerance_ns = 0;  // largest distance from an image of camera 0 at which an image joined its frame
};

// Groups images by the rule of image/frame_grouping.h: every image belongs to one frame. A camera that captures at
// about the same time relative to camera 0 (image/capture_phase.h) is grouped as if it captured together with it; its
// images keep their times, and the tolerance is at least a tenth of the period of camera 0. `images[i]` are the images
// of camera i, strictly increasing in time. Camera 0 must have at least one.
FrameGrouping group_frames(std::span<const std::vector<image_files::ImageFile>> images, TimeNs tolerance_ns);

// The frames in which the images were recorded (ImageFile::frame_ns). Returns nullopt if that of an image is unknown,
// or if these are no frames: two images of one camera in one, images of one more than a second apart, or times of
// frames that do not increase, as with other cameras or time offsets than those of the recording.
std::optional<FrameGrouping> recorded_frames(std::span<const std::vector<image_files::ImageFile>> images);

}  // namespace bslam::dataset
