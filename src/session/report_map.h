// The map and the rig as data of the report.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "base/timestamp.h"
#include "geometry/up_axis.h"
#include "map/bundled_map.h"
#include "session/report_arrays.h"
#include "system/system.h"

namespace bslam::session {

// One entry per submap, in its own world frame: first those of the trajectories in their order, then those without
// poses. Times are in seconds since `first_time_ns`. `up`: what points upward in the views; by default, and if it has
// no mean direction in a submap, vertical_direction.
nlohmann::ordered_json report_submaps(const map::BundledMap& map, std::span<const system::SubmapTrajectory> paths,
                                      TimeNs first_time_ns, const ReportLimits& limits = {},
                                      const std::optional<geometry::UpAxis>& up = {});

// Per camera: name, model, image size, pose in the rig, and the rays of the image's corners at depth 1. The rays of a
// field of view that is too wide to be drawn are limited.
nlohmann::ordered_json report_rig(const camera::Rig& rig);

}  // namespace bslam::session
