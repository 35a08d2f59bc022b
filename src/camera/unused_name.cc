#include "camera/unused_name.h"

#include <algorithm>

namespace bslam::camera {

std::string unused_name(std::span<const RigCamera> taken, const std::string& name) {
  const auto is_taken = [&](const std::string& n) {
    return std::ranges::any_of(taken, [&](const RigCamera& c) { return c.camera.name == n; });
  };
  std::string out = name;
  for (std::size_t i = taken.size(); is_taken(out); ++i) out = "cam" + std::to_string(i);
  return out;
}

}  // namespace bslam::camera
