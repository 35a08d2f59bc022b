// Compares the estimated scale of a map with the truth of simulated trajectories.
#include "mapping/rig_scale.h"

#include <gtest/gtest.h>

#include "solver/scene.h"

namespace bslam::mapping {
namespace {

namespace scene = solver::scene;
using camera::Rig;
using geometry::SE3;
using geometry::Vector3d;
struct SimulatedMotion {
  Rig rig;
  solver::ReprojectionProblem problem;  // its rig points to `rig`
};

// Ten poses, 0.15 m apart, rotated by `turn_rad` from one to the next; true values, and pixels with noise of 1 px.
// Points observed by several cameras would determine the scale without rotation, so each one is observed by one camera
// only.
std::unique_ptr<SimulatedMotion> make_motion(double turn_rad, Random& random, std::size_t cameras = 3) {
  auto out = std::make_unique<SimulatedMotion>(SimulatedMotion{scene::make_rig(cameras, scene::Models::kRadTan), {}});
  solver::ReprojectionProblem& problem = out->problem;
  problem.rig = &out->rig;
  SE3 T_world_rig;
  for (int k = 0; k < 10; ++k) {
    problem.T_rig_world.push_back(T_world_rig.inverse());
    problem.pose_free.push_back(k > 0);
    const Vector3d axis = Vector3d(0.2 * std::sin(k), 1.0, 0.1 * std::cos(k)).normalized();
    T_world_rig = T_world_rig * SE3(Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, axis)), Vector3d(0.05, 0.02, 0.14));
  }
  for (int p = 0; p < 1500; ++p) {
    const Vector3d point = scene::random_visible_point(out->rig, problem.T_rig_world[random.below(10)], random, 6.0);
    problem.points.push_back(point);
    for (int k = 0; k < 10; ++k) {
      for (std::size_t i = 0; i < out->rig.size(); ++i) {
        auto pixel = scene::see(out->rig, i, problem.T_rig_world[static_cast<std::size_t>(k)], point);
        if (!pixel || i != static_cast<std::size_t>(p) % cameras)
          continue;  // each point is observed by one camera only
        *pixel += scene::random_noise(random);
        problem.observations.push_back({k, p, CameraIndex(i), pixel->cast<float>(), 1.0f});
      }
    }
  }
  return out;
}

// Converts the problem to a map whose unit is 1 / `factor` metres.
void grow(solver::ReprojectionProblem& problem, double factor) {
  for (SE3& T : problem.T_rig_world) T = SE3(T.rotation(), factor * T.translation());
  for (Vector3d& p : problem.points) p *= factor;
}

// Adjusts the problem with two fixed poses, so that rotations and positions have the errors due to pixel noise.
void adjust_with_fixed_poses(solver::ReprojectionProblem& problem) {
  problem.pose_free[1] = 0;
  solver::adjust(problem, {.iterations = 20});
  problem.pose_free[1] = 1;
}

TEST(RigScale, IsOneForATrueMapWithinItsDeviation) {
  double squared_z = 0.0;
  constexpr int kSeeds = 25;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), "ride");
    const auto motion = make_motion(0.05, random);
    const auto found = rig_scale(motion->problem);
    ASSERT_TRUE(found.has_value());
    EXPECT_LT(found->deviation, 0.03);
    const double z = (found->scale - 1.0) / found->deviation;
    EXPECT_LT(std::abs(z), 4.5) << "seed " << seed << ": " << found->scale << " +- " << found->deviation;
    squared_z += z * z;
  }
  EXPECT_GT(squared_z / kSeeds, 0.4);
  EXPECT_LT(squared_z / kSeeds, 2.0);
}

TEST(RigScale, EstimatesAScaleThatIsWrongByAnyFactor) {
  for (const double factor : {1.0 / 3.0, 0.7, 1.5, 3.0, 10.0}) {
    Random random(3, "grown");
    const auto motion = make_motion(0.05, random);
    grow(motion->problem, factor);
    double unit = factor;
    std::optional<RigScale> found;
    for (int i = 0; i < 8; ++i) {
      found = rig_scale(motion->problem);
      ASSERT_TRUE(found.has_value()) << factor;
      grow(motion->problem, found->scale);
      unit *= found->scale;
    }
    EXPECT_NEAR(unit, 1.0, 4.0 * found->deviation) << factor;
    EXPECT_LT(found->deviation, 0.03);
  }
}

TEST(RigScale, EstimatesTheScaleOfAMapAdjustedWithAWrongOne) {
  for (const double factor : {0.4, 2.5}) {
    Random random(5, "bent");
    const auto motion = make_motion(0.05, random);
    grow(motion->problem, factor);
    solver::adjust(motion->problem, {.iterations = 10});
    std::optional<RigScale> found;
    for (int i = 0; i < 4; ++i) {
      found = rig_scale(motion->problem);
      ASSERT_TRUE(found.has_value());
      grow(motion->problem, found->scale);
      solver::adjust(motion->problem, {.iterations = 10});
    }
    const double length = motion->problem.T_rig_world.back().inverse().translation().norm();
    Random same(5, "bent");
    const double truth = make_motion(0.05, same)->problem.T_rig_world.back().inverse().translation().norm();
    EXPECT_NEAR(length / truth, 1.0, 4.0 * found->deviation) << factor;
  }
}

// The rig with all cameras but the first turned by random angles.
Rig turned(const Rig& rig, double sigma_rotation, Random& random) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const Vector3d angles =
        c == 0 ? Vector3d::Zero().eval() : sigma_rotation * Vector3d(random.normal(), random.normal(), random.normal());
    cameras.push_back({rig.camera(c), rig.body_from_cam(c) * SE3(geometry::so3_exp(angles), Vector3d::Zero())});
  }
  return Rig(std::move(cameras));
}

TEST(RigScale, ItsDeviationIncludesThatOfCalibratedRotations) {
  constexpr int kSeeds = 25;
  constexpr double kSigmaRotation = 0.005;
  double squared_z = 0.0, squared_z_exact = 0.0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), "turned");
    const auto motion = make_motion(0.02, random);
    motion->rig = turned(motion->rig, kSigmaRotation, random);
    adjust_with_fixed_poses(motion->problem);
    const auto found = rig_scale(motion->problem, {.sigma_rotation = kSigmaRotation});
    const auto exact = rig_scale(motion->problem);
    ASSERT_TRUE(found && exact);
    squared_z += std::pow((found->scale - 1.0) / found->deviation, 2);
    squared_z_exact += std::pow((exact->scale - 1.0) / exact->deviation, 2);
  }
  EXPECT_LT(squared_z / kSeeds, 2.0);
  EXPECT_GT(squared_z / kSeeds, 0.3);
  EXPECT_GT(squared_z_exact / kSeeds, 3.0);
}

// Observations that are repeated have the information of one, also relative to that of the calibrated rotations.
TEST(RigScale, ItsDeviationAllowsForCorrelatedObservations) {
  constexpr double kSigmaRotation = 0.01;
  Random random(2, "repeated");
  const auto motion = make_motion(0.03, random);
  adjust_with_fixed_poses(motion->problem);
  const auto once = rig_scale(motion->problem, {.sigma_rotation = kSigmaRotation});
  const auto exact = rig_scale(motion->problem);
  std::vector<solver::ReprojectionProblem::Observation> four_times;
  for (const auto& observation : motion->problem.observations) four_times.insert(four_times.end(), 4, observation);
  motion->problem.observations = std::move(four_times);
  const auto repeated = rig_scale(motion->problem, {.sigma_rotation = kSigmaRotation, .correlated_observations = 4.0});
  ASSERT_TRUE(once && exact && repeated);
  EXPECT_GT(once->deviation, 1.2 * exact->deviation);
  EXPECT_NEAR(repeated->deviation / once->deviation, 1.0, 0.1);
}

TEST(RigScale, IsNotObservableOnAStraightLine) {
  for (int seed = 0; seed < 10; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), "straight");
    const auto motion = make_motion(0.0, random);
    adjust_with_fixed_poses(motion->problem);
    const auto found = rig_scale(motion->problem);
    EXPECT_TRUE(!found || found->deviation > 0.3)
        << "seed " << seed << ": " << found->scale << " +- " << found->deviation;
  }
}

TEST(RigScale, IsNotObservableWithOneCamera) {
  Random random(1, "one camera");
  const auto motion = make_motion(0.05, random, 1);
  EXPECT_FALSE(rig_scale(motion->problem).has_value());
}

}  // namespace
}  // namespace bslam::mapping
