#include "system/input_check.h"

namespace bslam::system {
namespace {

std::string size_text(int width, int height) { return std::to_string(width) + " x " + std::to_string(height); }

}  // namespace

Status check_count(std::size_t images, const camera::Rig& rig, const std::string& where) {
  if (images == rig.size()) return {};
  return Error{where, "images", std::to_string(images), std::to_string(rig.size()) + ", one per camera of the rig"};
}

Status check_size(int width, int height, const camera::Camera& camera, const std::string& where) {
  if (width == camera.width && height == camera.height) return {};
  return Error{where, camera.name, "an image of " + size_text(width, height),
               size_text(camera.width, camera.height) + ", as in the calibration"};
}

Status check_later(TimeNs time_ns, TimeNs before_ns, const std::string& where) {
  if (time_ns > before_ns) return {};
  return Error{where, "time", std::to_string(time_ns) + " ns",
               "a time after " + std::to_string(before_ns) + " ns, that of the last frame"};
}

Status check_frame(const image::ImageBundle& images, const camera::Rig& rig, const std::optional<FrameStamp>& before) {
  const std::string frame = "frame " + std::to_string(images.id.value());
  if (const Status count = check_count(images.images.size(), rig, frame); !count) return count;
  if (!images.id.valid()) return Error{frame, "id", std::to_string(images.id.value()), "a number from 0 on"};
  if (before && images.id <= before->id) {
    return Error{frame, "id", std::to_string(images.id.value()),
                 "a number larger than " + std::to_string(before->id.value()) + ", the id of the last frame"};
  }
  if (before) {
    if (const Status later = check_later(images.time_ns, before->time_ns, frame); !later) return later;
  }
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const image::CameraImage& image = images.images[c];
    if (image.state != image::ImageState::kPresent) continue;
    const image::ImageView pixels = image.view();
    if (const Status size = check_size(pixels.width, pixels.height, rig.camera(c), frame); !size) return size;
  }
  return {};
}

}  // namespace bslam::system
