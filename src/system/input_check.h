// Checks the input of a caller.
#pragma once

#include <optional>
#include <span>

#include "base/result.h"
#include "camera/rig.h"
#include "image/image_bundle.h"

namespace bslam::system {

// Id and time of an input frame.
struct FrameStamp {
  FrameId id;
  TimeNs time_ns = 0;
};

// Errors: the number of images differs from the number of cameras; the size of an image differs from its camera's; the
// id or time is not larger than that of the previous frame `before`, if there is one.
Status check_frame(const image::ImageBundle& images, const camera::Rig& rig, const std::optional<FrameStamp>& before);

// Errors: the number of masks differs from the number of cameras and is not 0; the size of a mask differs from the size
// of its camera's images, and it is not empty.
Status check_masks(std::span<const image::Image> masks, const camera::Rig& rig);

}  // namespace bslam::system
