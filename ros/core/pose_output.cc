#include "core/pose_output.h"

namespace bslam_ros {

PoseOutput PoseConverter::convert(const bslam::FrameResult& frame) {
  PoseOutput out;
  out.time_ns = frame.time_ns;
  if (!has_base_cam0_) T_base_cam0_ = frame.T_odom_body.inverse() * frame.T_odom_cam0;
  has_base_cam0_ = true;
  const Pose T_start_base = T_base_cam0_ * frame.T_odom_body;
  if (restarted_) T_odom_start_ = T_odom_base_ * T_start_base.inverse();
  restarted_ = false;
  out.T_map_base = to_map(frame.T_world_body);
  T_odom_base_ = out.T_odom_base = T_odom_start_ * T_start_base;
  out.T_map_odom = map_from_odom(out.T_map_base, out.T_odom_base);
  out.covariance_map = out.covariance_odom = unknown_covariance();
  if (frame.covariance) {
    out.covariance_map = to_ros_covariance(*frame.covariance, T_base_cam0_, out.T_map_base);
    out.covariance_odom = to_ros_covariance(*frame.covariance, T_base_cam0_, out.T_odom_base);
  }
  out.velocity_known = frame.velocity.has_value();
  if (frame.velocity) out.velocity = *frame.velocity;
  return out;
}

}  // namespace bslam_ros
