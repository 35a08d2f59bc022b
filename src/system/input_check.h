// Is what a caller hands in a frame of this rig?
#pragma once

#include <optional>

#include "base/result.h"
#include "camera/rig.h"
#include "image/image_bundle.h"

namespace bslam::system {

// What identifies an input frame in time.
struct FrameStamp {
  FrameId id;
  TimeNs time_ns = 0;
};

// Errors: not one entry per camera; an image of another size than its camera's; an id or a time that is not after that
// of the frame before, where there was one.
Status check_frame(const image::ImageBundle& images, const camera::Rig& rig, const std::optional<FrameStamp>& before);

}  // namespace bslam::system
