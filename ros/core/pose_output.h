// Poses in the frames of ROS, from those of the library.
#pragma once

#include <bslam/bslam.h>

#include <optional>

#include "core/outputs.h"

namespace bslam_ros {

// `map` and `odom` of ROS are the frames `world` and `odom` of the library, whose axes are those of the reported camera
// 0 (RigFrame::kCamera0), moved by its pose T_base_cam0 on the robot: at the start base_link is at the origin, with x
// forward, y left and z up. The odometry pose is continued when another System takes over.
class PoseConverter {
 public:
  // The body frame of the rig must be base_link. Until the first frame, T_base_cam0 is that of the calibration, from
  // which it differs by a rotation if a refinement has moved the principal point of camera 0.
  explicit PoseConverter(const bslam::Rig& rig) : T_base_cam0_(rig.camera(0).T_body_cam) {}

  // The next frame is that of another System, whose odometry begins at the present pose.
  void restart() { restarted_ = true; }

  // `frame` must be tracking.
  PoseOutput convert(const bslam::FrameResult& frame);

  Pose to_map(const Pose& T_world_body) const { return T_base_cam0_ * T_world_body; }
  std::array<double, 3> to_map(const std::array<double, 3>& point_world) const { return T_base_cam0_ * point_world; }

 private:
  Pose T_base_cam0_;
  bool has_base_cam0_ = false;  // T_base_cam0_ is that of the frames
  Pose T_odom_start_;           // from the odometry of the present System to that of the first one
  Pose T_odom_base_;            // last one
  bool restarted_ = false;
};

// The transform map -> odom if another node publishes odom -> base_link.
inline Pose map_from_odom(const Pose& T_map_base, const Pose& T_odom_base) {
  return T_map_base * T_odom_base.inverse();
}

}  // namespace bslam_ros
