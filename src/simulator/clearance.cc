#include "simulator/clearance.h"

#include <algorithm>
#include <cmath>

namespace bslam::simulator {
namespace {

constexpr double kStep_s = 0.04;  // a few centimetres of a tour on foot
constexpr double kStep_m = 0.05;  // the largest step of a vehicle: less than the things beside a road

constexpr int kWindow = 25;  // steps for which nearby surfaces are selected at once

// The time between checks: that of a tour on foot, or shorter if the rig moves faster.
double step_of(const synthetic::Trajectory& trajectory, double from_s, double to_s) {
  double fastest = 0;
  for (double time_s = from_s; time_s < to_s; time_s += 0.1)
    fastest = std::max(fastest, trajectory.velocity(time_s).norm());
  return fastest > kStep_m / kStep_s ? kStep_m / fastest : kStep_s;
}

// The surfaces that cameras of the rig may touch within the kWindow steps from a time.
std::vector<Surface> surfaces_near(const std::vector<Surface>& surfaces, const camera::Rig& rig,
                                   const synthetic::Trajectory& trajectory, double time_s, double step_s) {
  double reach = 0;
  for (std::size_t c = 0; c < rig.size(); ++c) reach = std::max(reach, rig.body_from_cam(c).translation().norm());
  const Vector3d from = trajectory.T_world_body(time_s).translation();
  double travelled = 0;
  for (int i = 0; i <= kWindow; ++i)
    travelled = std::max(travelled, (trajectory.T_world_body(time_s + i * step_s).translation() - from).norm());
  std::vector<Surface> near;
  for (const Surface& s : surfaces) {
    if (distance_to_surfaces({&s, 1}, from) < reach + travelled + kCameraClearance) near.push_back(s);
  }
  return near;
}

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
                                         const synthetic::Trajectory& trajectory, double from_s, double to_s) {
  const double step_s = step_of(trajectory, from_s, to_s);
  const auto steps = static_cast<int>(std::ceil((to_s - from_s) / step_s));
  std::vector<Surface> near;
  for (int i = 0; i <= steps; ++i) {
    const double time_s = std::min(to_s, from_s + i * step_s);
    if (i % kWindow == 0) near = surfaces_near(surfaces, rig, trajectory, time_s, step_s);
    const geometry::SE3 T_world_body = trajectory.T_world_body(time_s);
    for (std::size_t c = 0; c < rig.size(); ++c) {
      const Vector3d at = T_world_body * rig.body_from_cam(c).translation();
      const auto between = [&](const Surface& s) { return crosses(s, T_world_body.translation(), at); };
      if (std::ranges::any_of(near, between)) return Collision{c, time_s, 0};
      const double distance = distance_to_surfaces(near, at);
      if (distance < kCameraClearance) return Collision{c, time_s, distance};
    }
  }
  return std::nullopt;
}

}  // namespace bslam::simulator
