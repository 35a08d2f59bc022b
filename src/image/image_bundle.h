// N images taken at the same time; any of them may be missing or damaged.
#pragma once

#include <vector>

#include "base/id.h"
#include "base/timestamp.h"
#include "image/image.h"

namespace bslam::image {

enum class ImageState {
  kPresent,
  kMissing,  // the camera has no image for this frame
  kDamaged,  // the image exists but cannot be used; it is skipped and counted
};

struct CameraImage {
  ImageState state = ImageState::kMissing;
  TimeNs time_ns = 0;  // capture time of this image, with the camera's time offset applied; valid only if kPresent
  Image image;         // pixels owned by this struct; empty unless kPresent, and if they are borrowed
  // Pixels owned by the caller, which must remain valid while the frame is processed. If empty, the pixels are in
  // `image`.
  ImageView borrowed = {};
  // Pixels of this image to ignore, where the mask is 0, in addition to those of the camera's mask; of the size of the
  // image, or empty if there is none. As for the image, the pixels are owned or borrowed.
  Image mask = {};
  ImageView borrowed_mask = {};

  ImageView view() const { return borrowed.empty() ? image.view() : borrowed; }
  ImageView mask_view() const { return borrowed_mask.empty() ? mask.view() : borrowed_mask; }
};

struct ImageBundle {
  FrameId id;  // input frames are numbered consecutively from 0
  // Time of the frame: the time of camera 0's image, or of the earliest other image if camera 0 has none.
  TimeNs time_ns = 0;
  std::vector<CameraImage> images;  // one per camera of the rig

  // Memory of the pixels that it owns.
  std::size_t memory_bytes() const {
    std::size_t bytes = 0;
    for (const CameraImage& i : images) bytes += i.image.memory_bytes() + i.mask.memory_bytes();
    return bytes;
  }
};

}  // namespace bslam::image
