#include "looping/essential_graph.h"

#include <algorithm>

namespace bslam::looping {

using geometry::Sim3;

int EssentialGraph::vertex(KeyframeId k) const {
  const auto at = std::ranges::lower_bound(keyframes, k);
  return at != keyframes.end() && *at == k ? static_cast<int>(at - keyframes.begin()) : -1;
}

EssentialGraph essential_graph(const map::BundledMap& map, KeyframeId root, int edge_weight) {
  EssentialGraph graph;
  const std::vector<KeyframeId> root_of_each = map.root_of_each();
  for (const KeyframeId k : map.keyframe_ids()) {
    if (root_of_each[k.index()] == root) graph.keyframes.push_back(k);
  }
  graph.problem.free_scale = map.scale() != map::Scale::kMetric;
  for (const KeyframeId k : graph.keyframes) {
    graph.problem.S_world.emplace_back(map.keyframe(k).T_rig_world);
    graph.problem.fixed.push_back(k == root);
  }
  const auto add_edge = [&](std::size_t a, KeyframeId other) {
    const int b = graph.vertex(other);
    if (b < 0) return;
    const Sim3 S_a_b = graph.problem.S_world[a] * graph.problem.S_world[static_cast<std::size_t>(b)].inverse();
    graph.problem.edges.push_back({static_cast<int>(a), b, S_a_b, 1.0});
  };
  for (std::size_t a = 0; a < graph.keyframes.size(); ++a) {
    const map::BundledKeyframe& keyframe = map.keyframe(graph.keyframes[a]);
    if (keyframe.parent.valid()) add_edge(a, keyframe.parent);
    for (const map::Covisible& c : keyframe.covisible) {
      const bool in_tree = c.keyframe == keyframe.parent || map.keyframe(c.keyframe).parent == graph.keyframes[a];
      if (c.weight >= edge_weight && c.keyframe < graph.keyframes[a] && !in_tree) add_edge(a, c.keyframe);
    }
  }
  return graph;
}

}  // namespace bslam::looping
