#include "api/conversions.h"

#include <utility>

namespace bslam::api {

using geometry::SE3;

namespace {

constexpr std::pair<Scale, map::Scale> kScales[] = {{Scale::kMetric, map::Scale::kMetric},
                                                    {Scale::kUpToScale, map::Scale::kUpToScale},
                                                    {Scale::kUnobservable, map::Scale::kUnobservable}};

}  // namespace

Pose to_pose(const SE3& T) {
  const auto& q = T.rotation();
  const auto& t = T.translation();
  return {{q.x(), q.y(), q.z(), q.w()}, {t.x(), t.y(), t.z()}};
}

SE3 to_se3(const Pose& pose) {
  const auto& q = pose.rotation;
  return {geometry::Quaterniond(q[3], q[0], q[1], q[2]),
          {pose.translation[0], pose.translation[1], pose.translation[2]}};
}

// A left perturbation d of T_rig_world is a right perturbation -d of T_world_rig: their covariances are equal.
Covariance6 to_covariance(const geometry::Matrix6d& covariance) {
  Covariance6 out;
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) out[static_cast<std::size_t>(6 * r + c)] = covariance(r, c);
  }
  return out;
}

// T_world_rig(t + dt) = T_world_rig(t) exp(-dt twist): in the axes of the rig, the velocity is -twist.
Velocity to_velocity(const geometry::Vector6d& twist, const SE3& T_frame_rig) {
  const geometry::Vector6d v = -(T_frame_rig.adjoint() * twist);
  return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

Scale to_scale(map::Scale scale) {
  for (const auto& [outer, inner] : kScales) {
    if (inner == scale) return outer;
  }
  return Scale::kMetric;
}

Trajectory to_trajectory(const evaluation::Trajectory& cam0, const std::optional<SE3>& T_rig_frame) {
  Trajectory out;
  out.reserve(cam0.size());
  for (const evaluation::TimedPose& p : cam0) {
    out.push_back({p.time_ns, to_pose(T_rig_frame ? p.T_world_frame * *T_rig_frame : p.T_world_frame)});
  }
  return out;
}

}  // namespace bslam::api

std::string_view bslam::to_string(Scale scale) {
  for (const auto& [outer, inner] : api::kScales) {
    if (outer == scale) return map::scale_name(inner);
  }
  return "";
}
