// Does what a caller hands in fit the rig?
#pragma once

#include <optional>
#include <span>

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

// Errors: another number of masks than cameras, unless there are none at all; a mask of another size than its camera's
// images, unless it is empty.
Status check_masks(std::span<const image::Image> masks, const camera::Rig& rig);

}  // namespace bslam::system
