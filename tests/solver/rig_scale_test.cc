// The length of a map's unit, against the truth of simulated rides.
#include "solver/rig_scale.h"

#include <gtest/gtest.h>

#include "solver/scene.h"

namespace bslam::solver {
namespace {

struct Ride {
  Rig rig;
  ReprojectionProblem problem;  // its rig points to `rig`
};

// Ten poses, 0.15 m apart, turning by `turn_rad` from one to the next; at the truth, pixels with noise of 1 px. A point
// that one camera hands to another would tell the scale without any rotation: each is seen by one camera alone.
std::unique_ptr<Ride> make_ride(double turn_rad, Random& random, std::size_t cameras = 3) {
  auto out = std::make_unique<Ride>(Ride{scene::make_rig(cameras, scene::Models::kRadTan), {}});
  ReprojectionProblem& problem = out->problem;
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
        if (!pixel || i != static_cast<std::size_t>(p) % cameras) continue;  // no point goes from camera to camera
        *pixel += Vector2d(random.normal(), random.normal());
        problem.observations.push_back({k, p, CameraIndex(i), pixel->cast<float>(), 1.0f});
      }
    }
  }
  return out;
}

// As a map would have it whose unit is 1 / `factor` metres.
void grow(ReprojectionProblem& problem, double factor) {
  for (SE3& T : problem.T_rig_world) T = SE3(T.rotation(), factor * T.translation());
  for (Vector3d& p : problem.points) p *= factor;
}

// What adjustment leaves of the truth where two poses are held: errors of rotations and places by the noise of the
// pixels.
void settle(ReprojectionProblem& problem) {
  problem.pose_free[1] = 0;
  adjust(problem, {.iterations = 20});
  problem.pose_free[1] = 1;
}

TEST(RigScale, IsOneOfATrueMapWithinItsDeviation) {
  double squared_z = 0.0;
  constexpr int kSeeds = 25;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), "ride");
    const auto ride = make_ride(0.05, random);
    const auto found = rig_scale(ride->problem);
    ASSERT_TRUE(found.has_value());
    EXPECT_LT(found->deviation, 0.03);
    const double z = (found->scale - 1.0) / found->deviation;
    EXPECT_LT(std::abs(z), 4.5) << "seed " << seed << ": " << found->scale << " +- " << found->deviation;
    squared_z += z * z;
  }
  EXPECT_GT(squared_z / kSeeds, 0.4);
  EXPECT_LT(squared_z / kSeeds, 2.0);
}

TEST(RigScale, FindsAUnitThatIsWrongByAnyFactor) {
  for (const double factor : {1.0 / 3.0, 0.7, 1.5, 3.0, 10.0}) {
    Random random(3, "grown");
    const auto ride = make_ride(0.05, random);
    grow(ride->problem, factor);
    double unit = factor;
    std::optional<RigScale> found;
    for (int i = 0; i < 8; ++i) {
      found = rig_scale(ride->problem);
      ASSERT_TRUE(found.has_value()) << factor;
      grow(ride->problem, found->scale);
      unit *= found->scale;
    }
    EXPECT_NEAR(unit, 1.0, 4.0 * found->deviation) << factor;
    EXPECT_LT(found->deviation, 0.03);
  }
}

TEST(RigScale, FindsTheUnitAgainAfterTheMapWasBentToAWrongOne) {
  for (const double factor : {0.4, 2.5}) {
    Random random(5, "bent");
    const auto ride = make_ride(0.05, random);
    grow(ride->problem, factor);
    adjust(ride->problem, {.iterations = 10});
    double scale = 1.0;
    std::optional<RigScale> found;
    for (int i = 0; i < 4; ++i) {
      found = rig_scale(ride->problem);
      ASSERT_TRUE(found.has_value());
      grow(ride->problem, found->scale);
      scale *= found->scale;
      adjust(ride->problem, {.iterations = 10});
    }
    const double length = ride->problem.T_rig_world.back().inverse().translation().norm();
    Random same(5, "bent");
    const double truth = make_ride(0.05, same)->problem.T_rig_world.back().inverse().translation().norm();
    EXPECT_NEAR(length / truth, 1.0, 4.0 * found->deviation) << factor;
  }
}

TEST(RigScale, IsUnknownOnAStraightLine) {
  for (int seed = 0; seed < 10; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), "straight");
    const auto ride = make_ride(0.0, random);
    settle(ride->problem);
    const auto found = rig_scale(ride->problem);
    EXPECT_TRUE(!found || found->deviation > 0.3)
        << "seed " << seed << ": " << found->scale << " +- " << found->deviation;
  }
}

TEST(RigScale, IsUnknownToOneCamera) {
  Random random(1, "one camera");
  const auto ride = make_ride(0.05, random, 1);
  EXPECT_FALSE(rig_scale(ride->problem).has_value());
}

}  // namespace
}  // namespace bslam::solver
