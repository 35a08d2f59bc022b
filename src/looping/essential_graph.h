// The essential graph of a part of the map: its spanning tree and its strong covisibility links, for pose-graph
// optimisation.
#pragma once

#include <vector>

#include "map/bundled_map.h"
#include "solver/pose_graph.h"

namespace bslam::looping {

struct EssentialGraph {
  std::vector<KeyframeId> keyframes;  // per vertex, in order of id
  solver::PoseGraphProblem problem;   // present poses; the root is fixed

  int vertex(KeyframeId k) const;  // -1 where it is not in the graph
};

// Edges measure the relative poses of `map`. Scale is free where the map's is not metric.
EssentialGraph essential_graph(const map::BundledMap& map, KeyframeId root, int edge_weight);

}  // namespace bslam::looping
