#include "synthetic/trajectory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/assert.h"
#include "base/random.h"
#include "synthetic/sway.h"

namespace bslam::synthetic {

using std::numbers::pi;

Trajectory::Trajectory(std::vector<ControlPose> control, double knot_spacing_s)
    : control_(std::move(control)), knot_spacing_s_(knot_spacing_s) {
  BSLAM_ASSERT(control_.size() >= 4 && knot_spacing_s > 0,
               "there must be four control poses, and the knot spacing must be positive");
}

Trajectory::Vector Trajectory::blend(double time_s, bool derivative) const {
  const double at = time_s / knot_spacing_s_;
  const double last = static_cast<double>(control_.size()) - 4.0;
  const double piece = std::clamp(std::floor(at), 0.0, last);
  const double t = at - piece, t2 = t * t, s = 1 - t;
  std::array<double, 4> weight;
  if (derivative) {
    weight = {-0.5 * s * s, 1.5 * t2 - 2 * t, -1.5 * t2 + t + 0.5, 0.5 * t2};
    for (double& w : weight) w /= knot_spacing_s_;
  } else {
    weight = {s * s * s / 6, (3 * t2 * t - 6 * t2 + 4) / 6, (-3 * t2 * t + 3 * t2 + 3 * t + 1) / 6, t2 * t / 6};
  }
  Vector sum = Vector::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const ControlPose& c = control_[static_cast<std::size_t>(piece) + i];
    Vector value;
    value << c.position, c.yaw, c.pitch, c.roll;
    sum += weight[i] * value;
  }
  return sum;
}

geometry::SE3 Trajectory::T_world_body(double time_s) const {
  const Vector v = blend(time_s, false);
  const Eigen::Quaterniond q = Eigen::AngleAxisd(v[3], Vector3d::UnitZ()) * Eigen::AngleAxisd(v[4], Vector3d::UnitY()) *
                               Eigen::AngleAxisd(v[5], Vector3d::UnitX());
  return {q, v.head<3>()};
}

Vector3d Trajectory::velocity(double time_s) const { return blend(time_s, true).head<3>(); }
double Trajectory::yaw_rate(double time_s) const { return blend(time_s, true)[3]; }

Trajectory make_orbit(const OrbitOptions& options) {
  BSLAM_ASSERT(options.duration_s > 0 && options.period_s > 0, "duration and period must be positive");
  Random random(options.seed, "orbit");
  const Sway base(random), own(random);
  const auto pieces = static_cast<std::size_t>(std::max(1.0, std::round(options.duration_s / kKnotSpacing)));
  const double spacing = options.duration_s / static_cast<double>(pieces);
  std::vector<ControlPose> control;
  for (std::size_t i = 0; i < pieces + 3; ++i) {
    const double rounds = (static_cast<double>(i) - 1) * spacing / options.period_s, angle = 2 * pi * rounds;
    const Offsets o = offsets_at(base, own, rounds - std::floor(rounds));
    const double radius = options.radius + o.lateral;
    control.push_back({options.centre + Vector3d(radius * std::cos(angle), radius * std::sin(angle), o.up),
                       angle + 0.5 * pi + o.yaw, o.pitch, o.roll});
  }
  return Trajectory(std::move(control), spacing);
}

}  // namespace bslam::synthetic
