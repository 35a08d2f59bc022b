#include "camera/camera_name.h"

#include <fmt/format.h>

namespace bslam::camera {

std::optional<std::size_t> camera_named(const std::string& name, const Rig& rig) {
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (rig.camera(c).name == name) return c;
  }
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (name == fmt::format("cam{}", c)) return c;
  }
  return std::nullopt;
}

std::optional<std::size_t> camera_of_frame(const std::string& frame, const Rig& rig) {
  if (frame.empty() || frame == "cam0") return 0;
  return camera_named(frame, rig);
}

}  // namespace bslam::camera
