// The keyframes as a pose graph in g2o's format.
#pragma once

#include <string>

#include "map_export/selection.h"

namespace bslam::map_export {

struct PoseGraphFile {
  std::string text;
  std::size_t vertices = 0, edges = 0;
};

// One VERTEX_SE3:QUAT per keyframe, T_world_cam0 in the order of time, and FIX for the first. One EDGE_SE3:QUAT per
// edge of the spanning tree and per pair of keyframes that share at least `min_shared` landmarks: T_i_j of the present
// poses, so that the graph is at its optimum. The information is that of the shared landmarks about T_i_j: their
// reprojection residuals in both keyframes, with the positions of the landmarks eliminated. Its order is g2o's,
// translation and then the vector part of the quaternion. Edges whose shared landmarks do not determine the pose, such
// as those between submaps that were joined by few landmarks, have `kWeakInformation` on the diagonal in addition.
PoseGraphFile g2o_text(const Selection& selection, int min_shared = 30);

inline constexpr double kWeakInformation = 1.0;  // standard deviations of 1 unit and about 2 rad

}  // namespace bslam::map_export
