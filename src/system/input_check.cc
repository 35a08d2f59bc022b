#include "system/input_check.h"

#include <string>

namespace bslam::system {
namespace {

std::string size_text(int width, int height) { return std::to_string(width) + " x " + std::to_string(height); }

}  // namespace

Status check_frame(const image::ImageBundle& images, const camera::Rig& rig, const std::optional<FrameStamp>& before) {
  const std::string frame = "frame " + std::to_string(images.id.value());
  if (images.images.size() != rig.size()) {
    return Error{frame, "images", std::to_string(images.images.size()),
                 std::to_string(rig.size()) + ", one per camera of the rig"};
  }
  if (!images.id.valid()) return Error{frame, "id", std::to_string(images.id.value()), "a number from 0 on"};
  if (before && images.id <= before->id) {
    return Error{frame, "id", std::to_string(images.id.value()),
                 "a number larger than " + std::to_string(before->id.value()) + ", the id of the last frame"};
  }
  if (before && images.time_ns <= before->time_ns) {
    return Error{frame, "time", std::to_string(images.time_ns) + " ns",
                 "a time after " + std::to_string(before->time_ns) + " ns, the time of the last frame"};
  }
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const image::CameraImage& image = images.images[c];
    const camera::Camera& camera = rig.camera(c);
    if (image.state != image::ImageState::kPresent) continue;
    const image::ImageView pixels = image.view();
    if (pixels.width == camera.width && pixels.height == camera.height) continue;
    return Error{frame, camera.name, "an image of " + size_text(pixels.width, pixels.height),
                 size_text(camera.width, camera.height) + ", as in the calibration"};
  }
  return {};
}

Status check_masks(std::span<const image::Image> masks, const camera::Rig& rig) {
  if (masks.empty()) return {};
  if (masks.size() != rig.size())
    return Error{"", "masks", std::to_string(masks.size()), std::to_string(rig.size()) + ", one per camera, or none"};
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const camera::Camera& camera = rig.camera(c);
    if (masks[c].empty() || (masks[c].width() == camera.width && masks[c].height() == camera.height)) continue;
    return Error{"", "mask of " + camera.name, size_text(masks[c].width(), masks[c].height()),
                 size_text(camera.width, camera.height) + ", as in the calibration"};
  }
  return {};
}

}  // namespace bslam::system
