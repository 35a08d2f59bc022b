// The map and the rig as data of the report.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <span>

#include "base/timestamp.h"
#include "geometry/vertical_direction.h"
#include "map/bundled_map.h"
#include "system/system.h"

namespace bslam::session {

inline constexpr std::size_t kMaxReportPoints = 100'000;  // landmarks in the report
inline constexpr std::size_t kMaxReportPoses = 20'000;    // poses and frames in the report

// Returns a number n so that every n-th of `count` things are at most `limit`.
std::size_t report_stride(std::size_t count, std::size_t limit);

using geometry::vertical_direction;  // `up` of a submap

// One entry per submap, in its own world frame: first those of the trajectories in their order, then those without
// poses. Landmarks are thinned out if there are more than kMaxReportPoints. Times are in seconds since `first_time_ns`.
nlohmann::ordered_json report_submaps(const map::BundledMap& map, std::span<const system::SubmapTrajectory> paths,
                                      TimeNs first_time_ns);

// Per camera: name, model, image size, pose in the rig, and the rays of the image's corners at depth 1. The rays of a
// field of view that is too wide to be drawn are limited.
nlohmann::ordered_json report_rig(const camera::Rig& rig);

}  // namespace bslam::session
