#include "adjustment/landmark_noise.h"

#include <gtest/gtest.h>

#include "solver/scene.h"

namespace bslam::adjustment {
namespace {

namespace scene = solver::scene;

bool noisy(std::size_t point) { return point % 3 == 0; }

// Every third point has six times the noise of the others, while all have the same stated standard deviation.
std::unique_ptr<scene::BundleScene> uneven_scene(std::uint64_t seed) {
  Random random(seed, "uneven");
  scene::BundleSpec spec;
  spec.cameras = 2;
  spec.noise = 0.2;
  auto out = scene::make_bundle_scene(spec, random);
  for (auto& o : out->problem.observations) {
    if (noisy(static_cast<std::size_t>(o.point)))
      o.pixel += Eigen::Vector2f(static_cast<float>(1.2 * random.normal()), static_cast<float>(1.2 * random.normal()));
  }
  return out;
}

solver::BundleOptions plain() { return {.iterations = 50, .relative_decrease = 1e-9, .robust = false}; }

std::vector<double> variances_of(const solver::ReprojectionProblem& problem, std::span<const std::uint8_t> skip) {
  return landmark_variances(problem, solver::squared_errors(problem), skip);
}

double pose_error(const scene::BundleScene& scene) {
  double sum = 0;
  for (std::size_t i = 0; i < scene.T_rig_world.size(); ++i)
    sum += scene::centre_error(scene.problem.T_rig_world[i], scene.T_rig_world[i]);
  return sum;
}

TEST(LandmarkVariances, AreLargerForInconsistentLandmarks) {
  const auto scene = uneven_scene(1);
  ASSERT_TRUE(solver::adjust(scene->problem, plain()).usable());
  const auto variances = variances_of(scene->problem, {});
  double steady = 0, uneven = 0;
  int n = 0, m = 0;
  for (std::size_t p = 0; p < variances.size(); ++p) {
    (noisy(p) ? uneven : steady) += variances[p];
    ++(noisy(p) ? m : n);
  }
  EXPECT_GT(uneven / m, 4 * steady / n);
}

TEST(LandmarkVariances, AreOneWithTooFewObservations) {
  const auto scene = uneven_scene(2);
  const std::vector<std::uint8_t> all(scene->problem.observations.size(), 1);
  for (const double v : variances_of(scene->problem, all)) EXPECT_EQ(v, 1.0);
  std::vector<std::uint8_t> but_one = all;
  but_one[0] = 0;
  for (const double v : variances_of(scene->problem, but_one)) EXPECT_EQ(v, 1.0);
}

TEST(AdjustWithVariances, ImprovesPoses) {
  double without = 0, with = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const auto scene = uneven_scene(seed);
    ASSERT_TRUE(solver::adjust(scene->problem, plain()).usable());
    without += pose_error(*scene);
    const auto before = scene->problem.observations;
    ASSERT_TRUE(adjust_with_variances(scene->problem, variances_of(scene->problem, {}), plain(), {}, {}).usable());
    with += pose_error(*scene);
    for (std::size_t i = 0; i < before.size(); ++i) ASSERT_EQ(scene->problem.observations[i].sigma, before[i].sigma);
  }
  EXPECT_LT(with, 0.7 * without);
}

}  // namespace
}  // namespace bslam::adjustment
