// Does what a caller hands in fit the rig?
#pragma once

#include <optional>
#include <string>

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

// Parts of it. `where`: what was given them, for the error.
Status check_count(std::size_t images, const camera::Rig& rig, const std::string& where);
Status check_size(int width, int height, const camera::Camera& camera, const std::string& where);
Status check_later(TimeNs time_ns, TimeNs before_ns, const std::string& where);

}  // namespace bslam::system
