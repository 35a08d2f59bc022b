// Pose solver, pose RANSAC, bundle adjustment and relative pose with the problem sizes of tracking, local and global
// bundle adjustment.
#include <benchmark/benchmark.h>

#include "../tests/solver/scene.h"
#include "estimators/pose_ransac.h"
#include "estimators/relative_pose.h"

namespace bslam::solver {
namespace {

// 1500 observations over four cameras; range(0): percentage of outliers.
void pose(benchmark::State& state) {
  const Rig rig = scene::make_rig(4, scene::Models::kRadTan);
  Random random(1);
  const auto scene = scene::make_pose_scene(rig, 1500, 1.0, 0.01 * static_cast<double>(state.range(0)), random);
  const SE3 guess = scene.T_rig_world.perturbed(scene::random_twist(random, 0.02, 0.1));
  for (auto _ : state) benchmark::DoNotOptimize(solve_pose(rig, scene.observations, guess, {}));
}
BENCHMARK(pose)->Arg(0)->Arg(30)->Unit(benchmark::kMicrosecond)->Name("solve_pose/outliers");

void ransac(benchmark::State& state) {
  const Rig rig = scene::make_rig(4, scene::Models::kRadTan);
  Random random(2);
  const auto scene = scene::make_pose_scene(rig, 1500, 1.0, 0.01 * static_cast<double>(state.range(0)), random);
  const SE3 guess = scene.T_rig_world.perturbed(scene::random_twist(random, 0.17, 0.5));
  for (auto _ : state)
    benchmark::DoNotOptimize(estimators::ransac_pose(rig, scene.observations, guess, {}, {}, Random(3)));
}
BENCHMARK(ransac)->Arg(30)->Arg(60)->Unit(benchmark::kMicrosecond)->Name("ransac_pose/outliers");

void bundle(benchmark::State& state, const scene::BundleSpec& spec, int iterations) {
  Random random(4);
  const auto scene = scene::make_bundle_scene(spec, random);
  BundleOptions options;
  options.iterations = iterations;
  options.relative_decrease = 0.0;
  std::size_t steps = 0;
  for (auto _ : state) {
    ReprojectionProblem problem = scene->problem;
    const LmSummary summary = adjust(problem, options);
    steps = static_cast<std::size_t>(summary.iterations);
    benchmark::DoNotOptimize(summary.final_cost);
  }
  state.counters["observations"] = static_cast<double>(scene->problem.observations.size());
  state.counters["steps"] = static_cast<double>(steps);
}

void local_adjustment(benchmark::State& state) {
  scene::BundleSpec spec;
  spec.models = scene::Models::kRadTan;
  spec.fixed_poses = 20;
  spec.free_poses = 12;
  spec.points = 4000;
  spec.poses_per_point = 12;
  spec.max_observations = 13;
  bundle(state, spec, 5);
}
BENCHMARK(local_adjustment)->Unit(benchmark::kMillisecond);

// range(0): number of free poses, with 200 points and 2000 observations each.
void global_adjustment(benchmark::State& state) {
  scene::BundleSpec spec;
  spec.models = scene::Models::kRadTan;
  spec.fixed_poses = 1;
  spec.free_poses = static_cast<int>(state.range(0));
  spec.points = 200 * spec.free_poses;
  spec.poses_per_point = 12;
  spec.max_observations = 13;
  bundle(state, spec, 10);
}
BENCHMARK(global_adjustment)->Arg(100)->Arg(400)->Unit(benchmark::kMillisecond);

void two_views(benchmark::State& state) {
  Random random(5);
  const SE3 T_b_a = SE3::exp(scene::random_twist(random, 0.1, 0.4));
  std::vector<estimators::BearingPair> pairs;
  while (pairs.size() < 1000) {
    const Vector3d point = random.uniform(2, 12) * scene::random_direction(random);
    if (point.z() < 0.5 * point.norm()) continue;
    const bool outlier = random.uniform() < 0.01 * static_cast<double>(state.range(0));
    const Vector3d seen = outlier ? scene::random_direction(random) : Vector3d((T_b_a * point).normalized());
    pairs.push_back({point.normalized(), (seen + 5e-4 * scene::random_direction(random)).normalized()});
  }
  for (auto _ : state) benchmark::DoNotOptimize(estimators::relative_pose(pairs, {}, Random(6)));
}
BENCHMARK(two_views)->Arg(0)->Arg(30)->Unit(benchmark::kMillisecond)->Name("relative_pose/outliers");

}  // namespace
}  // namespace bslam::solver
