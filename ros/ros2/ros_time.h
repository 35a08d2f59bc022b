// Times of ROS 2, which may be negative.
#pragma once

#include <builtin_interfaces/msg/time.hpp>
#include <limits>

#include "core/geometry.h"

namespace bslam_ros {

inline void set_stamp(std::int64_t time_ns, builtin_interfaces::msg::Time& out) {
  const Stamp stamp = to_stamp(time_ns, std::numeric_limits<std::int32_t>::min());
  out.sec = stamp.sec;
  out.nanosec = stamp.nanosec;
}

inline bslam::Result<std::int64_t> stamp_ns(const builtin_interfaces::msg::Time& time) {
  return to_ns(time.sec, time.nanosec);
}

}  // namespace bslam_ros
