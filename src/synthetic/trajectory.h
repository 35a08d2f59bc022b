// Ground-truth motion of the simulated rig: a smooth curve of poses that can be evaluated at any time.
#pragma once

#include <vector>

#include "geometry/se3.h"

namespace bslam::synthetic {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Control pose of the spline. The body's x axis points forward, y left, z up.
struct ControlPose {
  Vector3d position = Vector3d::Zero();  // metres, world
  double yaw = 0, pitch = 0, roll = 0;   // radians, without wrap-around: R_world_body = Rz(yaw) Ry(pitch) Rx(roll)
};

// Uniform cubic B-spline over the position and the three angles; twice continuously differentiable.
class Trajectory {
 public:
  // Control pose i determines the pose around the time (i - 1) * knot_spacing_s. There must be at least four.
  Trajectory(std::vector<ControlPose> control, double knot_spacing_s);

  double duration_s() const { return (static_cast<double>(control_.size()) - 3.0) * knot_spacing_s_; }

  // `time_s` counts from the start of the trajectory. Outside [0, duration] the polynomials of the end segments are
  // extrapolated, which allows for images captured a few milliseconds beyond the end.
  geometry::SE3 T_world_body(double time_s) const;
  Vector3d velocity(double time_s) const;  // metres per second, world
  double yaw_rate(double time_s) const;    // radians per second

 private:
  using Vector = Eigen::Matrix<double, 6, 1>;  // position, yaw, pitch, roll
  Vector blend(double time_s, bool derivative) const;

  std::vector<ControlPose> control_;
  double knot_spacing_s_;
};

// Circles about the vertical axis through `centre`, looking along the direction of motion, with slight sway. For rooms
// without a predefined tour.
struct OrbitOptions {
  Vector3d centre = {0, 0, 1.5};  // metres
  double radius = 1.5;            // metres
  double period_s = 12.0;         // duration of one circle
  double duration_s = 12.0;
  std::uint64_t seed = 1;
};
Trajectory make_orbit(const OrbitOptions& options);

}  // namespace bslam::synthetic
