// What the nodes publish, without messages of ROS.
#pragma once

#include <bslam/bslam.h>

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/geometry.h"

namespace bslam_ros {

// Pose of a frame that is tracked. All frames have the axes of ROS: `map` and `odom` are the pose of base_link at the
// start of the submap and at the first pose.
struct PoseOutput {
  std::int64_t time_ns = 0;
  Pose T_map_base, T_odom_base;
  Pose T_map_odom;                // T_map_base = T_map_odom * T_odom_base
  RosCovariance covariance_map;   // of T_map_base, in the axes of `map`
  RosCovariance covariance_odom;  // the same in the axes of `odom`
  bslam::Velocity velocity;       // of base_link, in its axes
  bool velocity_known = false;
};

struct PointCloud {
  std::int64_t time_ns = 0;
  struct Point {
    float x, y, z;       // in `map`
    float observations;  // number of keyframes that observe the point
  };
  std::vector<Point> points;
};

struct PathOutput {
  std::int64_t time_ns = 0;
  std::vector<std::pair<std::int64_t, Pose>> poses;  // times and T_map_base, corrected by the present map
};

// Levels of diagnostic_msgs/DiagnosticStatus.
enum class Level : std::uint8_t { kOk = 0, kWarn = 1, kError = 2, kStale = 3 };

struct DiagnosticStatus {
  std::string name;  // "bslam: tracking", "bslam: camera NAME"
  Level level = Level::kOk;
  std::string message;
  std::vector<std::pair<std::string, std::string>> values;
};

// Called by the thread of the runner, except for `log`, which any thread may call. Each may be empty.
struct Outputs {
  std::function<void(const PoseOutput&)> pose;
  std::function<void(const PointCloud&)> cloud;
  std::function<void(const PathOutput&)> path;
  std::function<void(const std::vector<DiagnosticStatus>&)> diagnostics;  // immediately after a change of a state
  std::function<std::size_t()> cloud_subscribers;                         // number; empty: one
  std::function<bool()> wants_path;                                       // false: nobody has subscribed
  std::function<void(bslam::LogLevel, const std::string&)> log;
};

}  // namespace bslam_ros
