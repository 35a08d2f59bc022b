// Observations from which the scale is estimated: of several cameras only if they saw a landmark at one time.
#include "mapping/predicted_matches.h"

#include <gtest/gtest.h>

#include "mapping/rig_scale.h"
#include "solver/scene.h"

namespace bslam::mapping {
namespace {

namespace scene = solver::scene;
using geometry::SE3;
using geometry::Vector3d;
using solver::ReprojectionProblem;

ReprojectionProblem::Observation seen(int pose, int point, int camera) {
  return {pose, point, CameraIndex(camera), Eigen::Vector2f(static_cast<float>(pose), static_cast<float>(camera)), 1};
}

struct Expected {
  int pose, point, camera;
};

void expect_observations(const ReprojectionProblem& problem, const std::vector<Expected>& expected) {
  ASSERT_EQ(problem.observations.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const auto& [pose, point, camera] = expected[i];
    const ReprojectionProblem::Observation& o = problem.observations[i];
    EXPECT_TRUE(o.pose == pose && o.point == point && o.camera == CameraIndex(camera)) << i;
    EXPECT_EQ(o.pixel, seen(pose, point, camera).pixel) << i;
  }
}

TEST(WithoutPredictedMatches, KeepsCamerasTogetherThatAreConnectedByMatchedFeatures) {
  const camera::Rig rig = scene::make_rig(3, scene::Models::kRadTan);
  ReprojectionProblem problem;
  problem.rig = &rig;
  problem.points = {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
  problem.observations = {
      seen(0, 0, 0), seen(1, 0, 0), seen(1, 0, 1), seen(2, 0, 1), seen(2, 0, 2),  // 0 with 1, and 1 with 2
      seen(0, 1, 2), seen(1, 1, 0), seen(2, 1, 2), seen(3, 1, 0),                 // never at one time
      seen(0, 2, 0), seen(1, 2, 0), seen(2, 2, 1),                                // once by camera 1
      seen(0, 3, 1), seen(1, 3, 0), seen(1, 3, 2), seen(2, 3, 1)                  // 0 with 2
  };
  const ReprojectionProblem divided = without_predicted_matches(problem);
  const std::vector<Vector3d> points = {{1, 0, 0}, {2, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {4, 0, 0}};
  EXPECT_EQ(divided.points, points);
  expect_observations(divided, {{0, 0, 0},
                                {1, 0, 0},
                                {1, 0, 1},
                                {2, 0, 1},
                                {2, 0, 2},
                                {1, 1, 0},
                                {3, 1, 0},
                                {0, 2, 2},
                                {2, 2, 2},
                                {0, 3, 0},
                                {1, 3, 0},
                                {1, 4, 0},
                                {1, 4, 2},
                                {0, 5, 1},
                                {2, 5, 1}});
}

// Two cameras that look to the front, 0.02 rad of rotation between poses, in a map of three times the true size. Each
// point is observed by one camera.
ReprojectionProblem too_large_map(const camera::Rig& rig, Random& random) {
  constexpr double kFactor = 3.0;
  ReprojectionProblem problem;
  problem.rig = &rig;
  SE3 T_world_rig;
  for (int k = 0; k < 10; ++k) {
    problem.T_rig_world.push_back(T_world_rig.inverse());
    problem.pose_free.push_back(k > 0);
    T_world_rig = T_world_rig * SE3(geometry::so3_exp(Vector3d(0.002, 0.02, 0.001)), Vector3d(0.05, 0.02, 0.14));
  }
  for (int p = 0; p < 600; ++p) {
    problem.points.push_back(scene::random_visible_point(rig, problem.T_rig_world[random.below(10)], random, 6.0));
    for (int k = 0; k < 10; ++k) {
      const auto c = static_cast<std::size_t>(p) % rig.size();
      const auto pixel = scene::see(rig, c, problem.T_rig_world[static_cast<std::size_t>(k)], problem.points.back());
      if (pixel) problem.observations.push_back({k, p, CameraIndex(c), pixel->cast<float>(), 1.0f});
    }
  }
  for (SE3& T : problem.T_rig_world) T = geometry::scaled(T, kFactor);
  for (Vector3d& p : problem.points) p *= kFactor;
  return problem;
}

// Adds what a repeated texture shows: every tenth landmark is found in other cameras, exactly where it is predicted.
void add_predicted_matches(ReprojectionProblem& problem) {
  std::vector<ReprojectionProblem::Observation> all;
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    all.push_back(problem.observations[i]);
    const int point = problem.observations[i].point;
    if (point % 10 != 0 || (i + 1 < problem.observations.size() && problem.observations[i + 1].point == point))
      continue;
    const std::size_t last_pose = problem.T_rig_world.size() - 1;
    const CameraIndex other((problem.observations[i].camera.index() + 1) % problem.rig->size());
    if (problem.observations[i].pose == static_cast<int>(last_pose)) all.pop_back();
    const auto pixel = scene::see(*problem.rig, other.index(), problem.T_rig_world[last_pose],
                                  problem.points[static_cast<std::size_t>(point)]);
    if (pixel) all.push_back({static_cast<int>(last_pose), point, other, pixel->cast<float>(), 1.0f});
  }
  problem.observations = std::move(all);
}

TEST(WithoutPredictedMatches, AWrongScaleIsNotConfirmedByThem) {
  Random random(4, "predicted");
  const camera::Rig rig = scene::make_rig(2, scene::Models::kRadTan);
  ReprojectionProblem problem = too_large_map(rig, random);
  add_predicted_matches(problem);
  const auto with = rig_scale(problem), without = rig_scale(without_predicted_matches(problem));
  ASSERT_TRUE(with && without);
  EXPECT_NEAR(with->scale, 1.0, 0.2);  // they do confirm it if they are not taken out
  EXPECT_LT(with->deviation, 0.1);
  EXPECT_LT(without->scale, 0.6);
}

}  // namespace
}  // namespace bslam::mapping
