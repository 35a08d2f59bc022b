// Checks the input of a caller.
#pragma once

#include <optional>
#include <string>

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

// The single checks. `where` names the input in the error.
Status check_count(std::size_t images, const camera::Rig& rig, const std::string& where);
Status check_size(int width, int height, const camera::Camera& camera, const std::string& where);
Status check_later(TimeNs time_ns, TimeNs before_ns, const std::string& where);

}  // namespace bslam::system
