#include "looping/essential_graph.h"

#include <gtest/gtest.h>

#include <set>

#include "simulated_hall.h"

namespace bslam::looping {
namespace {

using Link = std::pair<KeyframeId, KeyframeId>;  // older, newer

std::multiset<Link> links_of(const EssentialGraph& graph) {
  std::multiset<Link> out;
  for (const auto& edge : graph.problem.edges) {
    out.insert(std::minmax(graph.keyframes[static_cast<std::size_t>(edge.a)],
                           graph.keyframes[static_cast<std::size_t>(edge.b)]));
  }
  return out;
}

// The expected edges of the graph: parents and strong covisibility, each pair once.
std::multiset<Link> expected_links(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes, int weight) {
  std::set<Link> out;
  for (const KeyframeId k : keyframes) {
    if (map.keyframe(k).parent.valid()) out.insert(std::minmax(k, map.keyframe(k).parent));
    for (const map::Covisible& c : map.keyframe(k).covisible) {
      if (c.weight >= weight) out.insert(std::minmax(k, c.keyframe));
    }
  }
  return {out.begin(), out.end()};
}

TEST(EssentialGraph, ContainsEveryKeyframeAtItsPose) {
  const map::BundledMap& map = map_without_drift(2).map;
  const EssentialGraph graph = essential_graph(map, KeyframeId(0), 60);
  EXPECT_EQ(graph.keyframes, map.keyframe_ids());
  ASSERT_EQ(graph.problem.S_world.size(), graph.keyframes.size());
  for (std::size_t v = 0; v < graph.keyframes.size(); ++v) {
    EXPECT_EQ(graph.vertex(graph.keyframes[v]), static_cast<int>(v));
    EXPECT_EQ(graph.problem.S_world[v].translation(), map.keyframe(graph.keyframes[v]).T_rig_world.translation());
    EXPECT_EQ(graph.problem.S_world[v].scale(), 1.0);
  }
  EXPECT_EQ(graph.vertex(KeyframeId(10000)), -1);
}

TEST(EssentialGraph, LinksParentsAndStrongNeighboursOnce) {
  const map::BundledMap& map = map_without_drift(2).map;
  for (const int weight : {1, 60, 100000}) {
    const EssentialGraph graph = essential_graph(map, KeyframeId(0), weight);
    EXPECT_EQ(links_of(graph), expected_links(map, graph.keyframes, weight));
  }
  EXPECT_EQ(essential_graph(map, KeyframeId(0), 100000).problem.edges.size(),
            map.num_keyframes() - 1);  // the spanning tree only
}

TEST(EssentialGraph, HasZeroResidualsAtTheCurrentPosesAndFixesOnlyTheRoot) {
  const map::BundledMap& map = map_with_drift(2).map;
  EssentialGraph graph = essential_graph(map, KeyframeId(0), 60);
  for (std::size_t v = 0; v < graph.keyframes.size(); ++v)
    EXPECT_EQ(graph.problem.fixed[v] != 0, graph.keyframes[v] == KeyframeId(0));
  const solver::LmSummary summary = optimise(graph.problem, {});
  EXPECT_LT(summary.initial_cost, 1e-12);
}

TEST(EssentialGraph, OptimisesTheScaleIfItIsNotObservable) {
  map::BundledMap map = map_without_drift(1).map;
  EXPECT_FALSE(essential_graph(map, KeyframeId(0), 60).problem.free_scale);
  map.set_scale(map::Scale::kUpToScale);
  EXPECT_TRUE(essential_graph(map, KeyframeId(0), 60).problem.free_scale);
}

TEST(EssentialGraph, ExcludesOtherSubmapsAndRemovedKeyframes) {
  const FeatureSimulator simulator = hall(rig_of(1));
  HallMap world(simulator.rig());
  for (int i = 0; i < 6; ++i) world.add(simulator.frame(FrameId(i), kStepS * i));
  for (int i = 6; i < 10; ++i) world.add(simulator.frame(FrameId(i), kStepS * (i - 4)), {}, 0, {}, i == 6);
  map::MapDraft draft = world.draft();
  ASSERT_TRUE(draft.remove_keyframe(KeyframeId(3)));
  const EssentialGraph first = essential_graph(draft.map(), KeyframeId(0), 60),
                       second = essential_graph(draft.map(), KeyframeId(6), 60);
  EXPECT_EQ(first.keyframes, (std::vector{KeyframeId(0), KeyframeId(1), KeyframeId(2), KeyframeId(4), KeyframeId(5)}));
  EXPECT_EQ(second.keyframes, (std::vector{KeyframeId(6), KeyframeId(7), KeyframeId(8), KeyframeId(9)}));
  EXPECT_EQ(links_of(first), expected_links(draft.map(), first.keyframes, 60));
  EXPECT_EQ(links_of(second), expected_links(draft.map(), second.keyframes, 60));
  EXPECT_EQ(first.problem.fixed, (std::vector<std::uint8_t>{1, 0, 0, 0, 0}));
  EXPECT_EQ(second.problem.fixed, (std::vector<std::uint8_t>{1, 0, 0, 0}));
}

}  // namespace
}  // namespace bslam::looping
