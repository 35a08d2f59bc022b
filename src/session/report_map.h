// The map and the rig as data of the report.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <span>

#include "base/timestamp.h"
#include "map/bundled_map.h"
#include "system/system.h"

namespace bslam::session {

inline constexpr std::size_t kMaxReportPoses = 20'000;

// Beyond these numbers landmarks, and poses and frames, are thinned out.
struct ReportLimits {
  std::size_t points = 100'000, poses = kMaxReportPoses;
};

// Returns a number n so that every n-th of `count` things are at most `limit`.
std::size_t report_stride(std::size_t count, std::size_t limit);

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
