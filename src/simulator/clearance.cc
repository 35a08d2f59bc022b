#include "simulator/clearance.h"

#include <algorithm>
#include <cmath>

namespace bslam::simulator {
namespace {

constexpr double kStep_s = 0.04;  // a few centimetres of a tour

// Whether the line from `a` to `b` passes through the rectangle.
bool crosses(const Surface& s, const Vector3d& a, const Vector3d& b) {
  const Vector3d n = s.u.cross(s.v);
  const double from = n.dot(a - s.origin), to = n.dot(b - s.origin);
  if (from * to > 0 || from == to) return false;
  const Vector3d d = a + from / (from - to) * (b - a) - s.origin;
  const double x = d.dot(s.u) / s.u.squaredNorm(), y = d.dot(s.v) / s.v.squaredNorm();
  return x >= 0 && x <= 1 && y >= 0 && y <= 1;
}

}  // namespace

std::optional<Collision> first_collision(const std::vector<Surface>& surfaces, const camera::Rig& rig,
                                         const synthetic::Trajectory& trajectory, double duration_s) {
  const auto steps = static_cast<int>(std::ceil(duration_s / kStep_s));
  for (int i = 0; i <= steps; ++i) {
    const double time_s = std::min(duration_s, i * kStep_s);
    const geometry::SE3 T_world_body = trajectory.T_world_body(time_s);
    for (std::size_t c = 0; c < rig.size(); ++c) {
      const Vector3d at = T_world_body * rig.body_from_cam(c).translation();
      const auto between = [&](const Surface& s) { return crosses(s, T_world_body.translation(), at); };
      if (std::ranges::any_of(surfaces, between)) return Collision{c, time_s, 0};
      const double distance = distance_to_surfaces(surfaces, at);
      if (distance < kCameraClearance) return Collision{c, time_s, distance};
    }
  }
  return std::nullopt;
}

}  // namespace bslam::simulator
