// N images taken together; any of them may be missing or damaged.
#pragma once

#include <vector>

#include "base/id.h"
#include "base/timestamp.h"
#include "image/image.h"

namespace bslam::image {

enum class ImageState {
  kPresent,
  kMissing,  // no image of this camera belongs to this instant
  kDamaged,  // there should be one, but it cannot be used: skipped and counted
};

struct CameraImage {
  ImageState state = ImageState::kMissing;
  TimeNs time_ns = 0;       // its own capture time, offset applied; meaningful where the state is kPresent
  Image image;              // pixels of our own; empty unless kPresent, and where they are borrowed
  ImageView borrowed = {};  // pixels of the caller, who keeps them while the frame is processed; empty: see `image`

  ImageView view() const { return borrowed.empty() ? image.view() : borrowed; }
};

struct ImageBundle {
  FrameId id;          // input frames are numbered from 0 without gaps
  TimeNs time_ns = 0;  // of the frame: camera 0's image, or the earliest of the others where that is missing
  std::vector<CameraImage> images;  // one per camera of the rig
};

}  // namespace bslam::image
