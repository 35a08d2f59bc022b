// Conventions of ROS: times, axes of frames, order and axes of covariances.
#pragma once

#include <bslam/bslam.h>

#include <array>
#include <cstdint>
#include <optional>

namespace bslam_ros {

using bslam::Pose;

// A time as ROS stores it. ROS 1 cannot represent times before 0.
struct Stamp {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;  // less than 1e9
};

// Converts without loss. Errors: `nanosec` of 1e9 or more.
bslam::Result<std::int64_t> to_ns(std::int64_t sec, std::uint32_t nanosec);

// Converts without loss. The seconds are rounded down, so that `nanosec` is not negative. Times that ROS 1
// (`first_sec` = 0) or ROS 2 (INT32_MIN) cannot represent become the nearest ones that it can.
Stamp to_stamp(std::int64_t time_ns, std::int64_t first_sec);

// Row-major 6x6 in the order of ROS: x, y, z in metres, then rotations about x, y, z in radians, both in the axes of
// the parent frame.
using RosCovariance = std::array<double, 36>;

// Variance, in m^2 and rad^2, that stands for "unknown" in messages without a value for that.
inline constexpr double kUnknownVariance = 1e6;
RosCovariance unknown_covariance();

// Converts the covariance of a pose T_parent_cam0 as in FrameResult: of the motion d, rotation first, in the axes of
// camera 0, with T_parent_cam0(true) = T_parent_cam0 exp(d). The result is that of T_parent_base with
// T_parent_base(true) position = position + d_position, rotation = exp(d_rotation) rotation, in the axes of the parent.
RosCovariance to_ros_covariance(const bslam::Covariance6& of_cam0, const Pose& T_base_cam0, const Pose& T_parent_base);

// The rig with another body frame: its T_body_cam become T_base_body * T_body_cam.
bslam::Result<bslam::Rig> with_base_as_body(const bslam::Rig& rig, const Pose& T_base_body);

// True if the z axis of the body frame is the optical axis of camera 0, as in calibrations whose body frame is that
// camera. Such a body frame has not the axes of REP 103: x forward, y left, z up.
bool body_has_optical_axes(const bslam::Rig& rig);

}  // namespace bslam_ros
