// Times of ROS 1, which begin at 0.
#pragma once

#include <ros/time.h>

#include "core/geometry.h"

namespace bslam_ros {

inline void set_stamp(std::int64_t time_ns, ros::Time& out) {
  const Stamp stamp = to_stamp(time_ns, 0);
  out = ros::Time(static_cast<std::uint32_t>(stamp.sec), stamp.nanosec);
}

inline bslam::Result<std::int64_t> stamp_ns(const ros::Time& time) { return to_ns(time.sec, time.nsec); }

}  // namespace bslam_ros
