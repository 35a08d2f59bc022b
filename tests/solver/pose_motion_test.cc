// Poses of a rig whose cameras have different capture times.
#include <gtest/gtest.h>

#include "solver/pose_problem.h"
#include "solver/scene.h"

namespace bslam::solver {
namespace {

using geometry::Vector6d;

constexpr double kWalk = 1.2, kTurn = 0.9;  // m/s, rad/s
constexpr double kInterval = 0.05;          // s

struct MotionScene {
  scene::PoseScene seen;
  MotionModel motion;
};

// Four cameras, of which the last two capture late, while the rig moves with the twist since the previous pose.
MotionScene make_motion_scene(const Rig& rig, double delay_s, double noise, Random& random) {
  const Vector6d twist = scene::random_twist(random, kTurn, kWalk);
  MotionScene out;
  out.motion.delay_s = {0.0, 0.0, delay_s, 1.5 * delay_s};
  out.motion.gain = 1.0 / kInterval;
  out.seen = scene::make_pose_scene(rig.moving(out.motion.delay_s, twist), 300, noise, 0.1, random);
  out.motion.T_before = SE3::exp(-kInterval * twist) * out.seen.T_rig_world;
  return out;
}

TEST(PoseWithMotion, EqualsTheTruthWithoutNoise) {
  const Rig rig = scene::make_rig(4, scene::Models::kMixed);
  Random random(2, "motion");
  for (int trial = 0; trial < 10; ++trial) {
    const MotionScene s = make_motion_scene(rig, 0.03, 0.0, random);
    const SE3 initial = s.seen.T_rig_world.perturbed(scene::random_twist(random, 0.01, 0.03));
    const PoseSolution solution = solve_pose(rig, s.seen.observations, initial, s.motion, {});
    ASSERT_TRUE(solution.ok) << trial;
    EXPECT_LT(scene::centre_error(solution.T_rig_world, s.seen.T_rig_world), 1e-4) << trial;
    EXPECT_LT(scene::rotation_error(solution.T_rig_world, s.seen.T_rig_world), 1e-5) << trial;
  }
}

TEST(PoseWithMotion, IsMuchMoreAccurateThanWithoutCaptureTimes) {
  const Rig rig = scene::make_rig(4, scene::Models::kRadTan);
  Random random(3, "motion");
  double own = 0, ignored = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const MotionScene s = make_motion_scene(rig, 0.03, 1.0, random);
    const auto& observations = s.seen.observations;
    const SE3& truth = s.seen.T_rig_world;
    own += scene::centre_error(solve_pose(rig, observations, truth, s.motion, {}).T_rig_world, truth);
    ignored += scene::centre_error(solve_pose(rig, observations, truth, {}).T_rig_world, truth);
  }
  EXPECT_LT(own, 0.3 * ignored);
}

TEST(PoseWithMotion, EqualsTheOrdinaryPoseForSimultaneousImages) {
  const Rig rig = scene::make_rig(4, scene::Models::kMixed);
  Random random(9);
  const auto scene = scene::make_pose_scene(rig, 200, 1.0, 0.1, random);
  const MotionModel motion{.delay_s = {0, 0, 0, 0}, .T_before = SE3(), .gain = 20.0};
  const PoseSolution a = solve_pose(rig, scene.observations, scene.T_rig_world, {});
  const PoseSolution b = solve_pose(rig, scene.observations, scene.T_rig_world, motion, {});
  EXPECT_EQ(a.inlier, b.inlier);
  EXPECT_EQ(a.T_rig_world.matrix(), b.T_rig_world.matrix());
}

// A pose whose observations follow the rows of rolling shutters.
TEST(PoseWithMotion, EqualsTheTruthForRollingShutters) {
  const Rig rig = scene::with_readout(scene::make_rig(4, scene::Models::kMixed), 0.02);
  Random random(5, "rolling");
  for (int trial = 0; trial < 10; ++trial) {
    const MotionScene s = make_motion_scene(rig, 0.013, 0.0, random);
    const SE3 initial = s.seen.T_rig_world.perturbed(scene::random_twist(random, 0.01, 0.03));
    const PoseSolution solution = solve_pose(rig, s.seen.observations, initial, s.motion, {});
    ASSERT_TRUE(solution.ok) << trial;
    EXPECT_LT(scene::centre_error(solution.T_rig_world, s.seen.T_rig_world), 1e-4) << trial;
    EXPECT_LT(scene::rotation_error(solution.T_rig_world, s.seen.T_rig_world), 1e-5) << trial;
    const Rig moving = rig.moving(s.motion.delay_s, s.motion.twist(s.seen.T_rig_world));
    const PoseSolution known = solve_pose(moving, s.seen.observations, initial, {});
    EXPECT_LT(scene::centre_error(known.T_rig_world, s.seen.T_rig_world), 1e-5) << trial;
  }
}

// b is minus the gradient of the cost; to second order in delay times twist.
TEST(PoseWithMotion, AgreesWithTheGradientOfItsCost) {
  const Rig rig = scene::make_rig(4, scene::Models::kMixed);
  Random random(11);
  const MotionScene s = make_motion_scene(rig, 0.04, 1.0, random);
  PoseProblem problem(rig, s.seen.observations, &s.motion);
  const SE3 at = s.seen.T_rig_world.perturbed(scene::random_twist(random, 0.01, 0.02));
  problem.select(at, 1e5);
  const PoseEquations equations = problem.linearise(at, Kernel::kNone);
  for (int k = 0; k < 6; ++k) {
    constexpr double kStep = 1e-7;
    const Vector6d delta = kStep * Vector6d::Unit(k);
    const double gradient = (problem.linearise(at.perturbed(delta), Kernel::kNone).cost -
                             problem.linearise(at.perturbed(-delta), Kernel::kNone).cost) /
                            (2 * kStep);
    EXPECT_NEAR(equations.b(k), -gradient, 1e-4 * equations.b.cwiseAbs().maxCoeff()) << k;
  }
}

}  // namespace
}  // namespace bslam::solver
