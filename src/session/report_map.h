// The map and the rig as data of the report.
#pragma once

#include <nlohmann/json.hpp>
#include <span>

#include "base/timestamp.h"
#include "map/bundled_map.h"
#include "session/report_arrays.h"
#include "system/system.h"

namespace bslam::session {

// The direction in the world that is vertical, if the rig stands or moves upright: the upward direction of camera 0's
// images, unless another direction of the camera is clearly more constant over the keyframes.
geometry::Vector3d vertical_direction(std::span<const geometry::SE3> T_world_rig);

// One entry per submap, in its own world frame: first those of the trajectories in their order, then those without
// poses. Times are in seconds since `first_time_ns`.
nlohmann::ordered_json report_submaps(const map::BundledMap& map, std::span<const system::SubmapTrajectory> paths,
                                      TimeNs first_time_ns, const ReportLimits& limits = {});

// Per camera: name, model, image size, pose in the rig, and the rays of the image's corners at depth 1. The rays of a
// field of view that is too wide to be drawn are limited.
nlohmann::ordered_json report_rig(const camera::Rig& rig);

}  // namespace bslam::session
