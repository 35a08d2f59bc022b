// The submaps of a map, their statistics and the trajectories of their keyframes.
#pragma once

#include <cstddef>
#include <vector>

#include "base/timestamp.h"
#include "evaluation/trajectory.h"
#include "map/bundled_map.h"

namespace bslam::storage {

// A submap: keyframes that are connected by one spanning tree.
struct Submap {
  KeyframeId root;
  std::vector<KeyframeId> keyframes;                 // ordered by time, then by id
  std::size_t landmarks = 0;                         // number of landmarks whose reference keyframe is in this submap
  Eigen::Vector3d extent = Eigen::Vector3d::Zero();  // metres: sides of the box around camera 0 of all keyframes, along
                                                     // the axes of the world
};

// Returns the submaps in the order of their root keyframes.
std::vector<Submap> submaps_of(const map::BundledMap& map);

// Returns the times of the first and the last keyframe of a submap.
TimeNs first_time(const map::BundledMap& map, const Submap& submap);
TimeNs last_time(const map::BundledMap& map, const Submap& submap);

// Returns T_world_cam0 of the keyframes of a submap. Of keyframes with equal times only the first is included.
evaluation::Trajectory keyframe_trajectory(const map::BundledMap& map, const Submap& submap);

}  // namespace bslam::storage
