#include "simulator/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulator/noise.h"

namespace bslam::simulator {

double distance_to_surfaces(std::span<const Surface> surfaces, const Vector3d& point) {
  double best = std::numeric_limits<double>::infinity();
  for (const Surface& s : surfaces) {
    const Vector3d d = point - s.origin;
    const double a = std::clamp(d.dot(s.u) / s.u.squaredNorm(), 0.0, 1.0);
    const double b = std::clamp(d.dot(s.v) / s.v.squaredNorm(), 0.0, 1.0);
    best = std::min(best, (d - a * s.u - b * s.v).squaredNorm());
  }
  return std::sqrt(best);
}

void add_box(std::vector<Surface>& surfaces, const Box& box, const Texture& sides, const Texture& top) {
  const Vector3d x = box.size.x() * Vector3d(std::cos(box.yaw), std::sin(box.yaw), 0);
  const Vector3d y = box.size.y() * Vector3d(-std::sin(box.yaw), std::cos(box.yaw), 0);
  const Vector3d z = box.size.z() * Vector3d::UnitZ();
  const Vector3d corner = box.bottom_centre - 0.5 * x - 0.5 * y;
  std::uint32_t face = 0;
  const auto add = [&](const Vector3d& origin, const Vector3d& u, const Vector3d& v, Texture texture) {
    texture.seed = hash(static_cast<std::int32_t>(++face), 7, texture.seed);
    surfaces.push_back({origin, u, v, texture});
  };
  add(corner, x, z, sides);
  add(corner + x, y, z, sides);
  add(corner + x + y, -x, z, sides);
  add(corner + y, -y, z, sides);
  add(corner + z, x, y, top);
  if (box.bottom_centre.z() > 0.01) add(corner + y, x, -y, top);
}

}  // namespace bslam::simulator
