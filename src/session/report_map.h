// The map and the rig as data of the report.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "base/timestamp.h"
#include "geometry/up_axis.h"
#include "map/bundled_map.h"
#include "session/report_arrays.h"
#include "session/run_record.h"
#include "system/system.h"

namespace bslam::session {

// What the report shows of a map beside the map itself.
struct SubmapsRequest {
  std::span<const system::SubmapTrajectory> paths;
  std::span<const PlaceEvent> loops;
  TimeNs first_time_ns = 0;
  ReportLimits limits = {};
  // What points upward in the views; by default, and if it has no mean direction in a submap, vertical_direction.
  std::optional<geometry::UpAxis> up = {};
};

// One entry per submap, in its own world frame: first those of the trajectories in their order, then those without
// poses. Times are in seconds since `first_time_ns`. Keyframes are in order of time, and `loops` are pairs of them.
nlohmann::ordered_json report_submaps(const map::BundledMap& map, const SubmapsRequest& request);

// Per camera: name, model, image size, pose in the rig, and the rays of the image's corners at depth 1. The rays of a
// field of view that is too wide to be drawn are limited.
nlohmann::ordered_json report_rig(const camera::Rig& rig);

}  // namespace bslam::session
