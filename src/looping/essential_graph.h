// The essential graph of a submap for pose-graph optimisation (as in ORB-SLAM): its spanning tree and its strong
// covisibility edges.
#pragma once

#include <vector>

#include "looping/pose_graph.h"
#include "map/bundled_map.h"

namespace bslam::looping {

struct EssentialGraph {
  std::vector<KeyframeId> keyframes;  // per vertex, in order of id
  PoseGraphProblem problem;           // initialised with the current poses; the root is fixed

  int vertex(KeyframeId k) const;  // returns -1 if k is not in the graph
};

// The edges measure the relative poses in `map`. The scale is optimised unless the map is metric.
EssentialGraph essential_graph(const map::BundledMap& map, KeyframeId root, int edge_weight);

}  // namespace bslam::looping
