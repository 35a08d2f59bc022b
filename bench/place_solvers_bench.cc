// Pose graph and absolute pose at the sizes of loop closing and relocalisation.
#include <benchmark/benchmark.h>

#include "../tests/solver/scene.h"
#include "estimators/absolute_pose.h"
#include "looping/pose_graph.h"

namespace bslam::solver {
namespace {

using geometry::Sim3;
using looping::PoseGraphProblem;

// range(0) vertices on two laps of a circle, with edges from every vertex to the four previous ones and, in the second
// lap, to the vertex at the same position of the first lap. The initial values are the concatenated odometry.
PoseGraphProblem loop(int count, bool free_scale) {
  Random random(1);
  PoseGraphProblem problem;
  problem.free_scale = free_scale;
  std::vector<Sim3> truth;
  for (int i = 0; i < count; ++i) {
    const double yaw = 4 * std::numbers::pi * i / count;
    const geometry::Quaterniond R(Eigen::AngleAxisd(yaw, Vector3d::UnitY()));
    truth.push_back(Sim3(1.0, R, 20 * Vector3d(-std::cos(yaw), 0, std::sin(yaw))).inverse());
  }
  const auto link = [&](int a, int b) {
    geometry::Vector7d off;
    off << scene::random_twist(random, 0.005, 0.02), free_scale ? 0.005 * random.normal() : 0.0;
    const auto& S_a_world = truth[static_cast<std::size_t>(a)];
    problem.edges.push_back({a, b, S_a_world * truth[static_cast<std::size_t>(b)].inverse() * Sim3::exp(off), 1.0});
  };
  problem.S_world = {truth[0]};
  for (int i = 1; i < count; ++i) {
    for (int k = 1; k <= 4 && k <= i; ++k) {
      link(i, i - k);
      if (k == 1) problem.S_world.push_back(problem.edges.back().S_a_b * problem.S_world.back());
    }
    link(i, i >= count / 2 ? i - count / 2 : std::max(0, i - 5));
    if (i < 5) problem.edges.pop_back();
  }
  problem.fixed.assign(truth.size(), 0);
  problem.fixed[0] = 1;
  return problem;
}

void pose_graph(benchmark::State& state, bool free_scale) {
  const PoseGraphProblem start = loop(static_cast<int>(state.range(0)), free_scale);
  LmSummary summary;
  for (auto _ : state) {
    PoseGraphProblem problem = start;
    summary = looping::optimise(problem, {});
    benchmark::DoNotOptimize(problem.S_world.data());
  }
  state.counters["edges"] = static_cast<double>(start.edges.size());
  state.counters["steps"] = summary.iterations;
}
BENCHMARK_CAPTURE(pose_graph, rigid, false)->Arg(1000)->Arg(4000)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(pose_graph, free_scale, true)->Arg(1000)->Arg(4000)->Unit(benchmark::kMillisecond);

// 130 observations; range(0): number of cameras, range(1): percentage of outliers.
void absolute(benchmark::State& state, scene::Models models) {
  const Rig rig = scene::make_rig(static_cast<std::size_t>(state.range(0)), models);
  Random random(2);
  const auto scene = scene::make_pose_scene(rig, 130, 1.0, 0.01 * static_cast<double>(state.range(1)), random);
  for (auto _ : state) benchmark::DoNotOptimize(estimators::absolute_pose(rig, scene.observations, {}, {}, Random(3)));
}
BENCHMARK_CAPTURE(absolute, radtan, scene::Models::kRadTan)
    ->ArgsProduct({{1, 2, 4}, {30, 70, 100}})
    ->Unit(benchmark::kMicrosecond)
    ->Name("absolute_pose/radtan");
BENCHMARK_CAPTURE(absolute, fisheye, scene::Models::kFisheye)
    ->ArgsProduct({{1, 2, 4}, {70}})
    ->Unit(benchmark::kMicrosecond)
    ->Name("absolute_pose/fisheye");

// 120 matches, with free scale; range(0): percentage of outliers.

}  // namespace
}  // namespace bslam::solver
