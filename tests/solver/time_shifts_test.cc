#include "solver/time_shifts.h"

#include <gtest/gtest.h>

#include <cmath>

#include "solver/scene.h"

namespace bslam::solver {
namespace {

using geometry::Vector6d;

constexpr double kWalk = 1.2, kTurn = 0.9;  // m/s, rad/s

// A rig whose images were captured with these shifts from the time of the pose, while it moved with the twist.
struct ShiftedScene {
  scene::PoseScene seen;
  Vector6d twist;
  std::vector<PoseObservation> observations;  // camera by camera
};

ShiftedScene make_shifted_scene(const Rig& rig, const std::vector<double>& shift_s, double noise, Random& random) {
  ShiftedScene out;
  out.twist = scene::random_twist(random, kTurn, kWalk);
  out.seen = scene::make_pose_scene(rig.moving(shift_s, out.twist), 300, noise, 0.0, random);
  out.observations = out.seen.observations;
  std::ranges::stable_sort(out.observations, {}, &PoseObservation::camera);
  return out;
}

// Unknown shifts of all cameras but the first.
ShiftPrior unknown(std::size_t cameras) {
  ShiftPrior out(cameras);
  for (std::size_t c = 1; c < cameras; ++c) out.set(c, ShiftPrior::kUnknown_s2);
  return out;
}

TEST(TimeShifts, StepsConvergeToTheTruthWithoutNoise) {
  const Rig rig = scene::make_rig(4, scene::Models::kMixed);
  const std::vector<double> truth = {0, 0.004, -0.007, 0.002};
  Random random(3, "shifts");
  for (int trial = 0; trial < 10; ++trial) {
    const ShiftedScene s = make_shifted_scene(rig, truth, 0.0, random);
    SE3 T = s.seen.T_rig_world.perturbed(scene::random_twist(random, 0.005, 0.02));
    std::vector<double> shift_s(4, 0.0);
    for (int step = 0; step < 6; ++step) {
      const ShiftStep found = time_shift_step(rig.moving(shift_s, s.twist), s.observations, T, s.twist, unknown(4));
      ASSERT_TRUE(found.all_finite());
      T = T.perturbed(found.pose);
      for (std::size_t c = 0; c < 4; ++c) shift_s[c] += found.shift_s(static_cast<Eigen::Index>(c));
    }
    for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(shift_s[c], truth[c], 2e-6) << "camera " << c;
    EXPECT_LT(scene::centre_error(T, s.seen.T_rig_world), 1e-5) << trial;
  }
}

TEST(TimeShifts, TheVarianceIsThatOfTheErrors) {
  const Rig rig = scene::make_rig(3, scene::Models::kRadTan);
  Random random(4, "shifts");
  double sum = 0;
  int count = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const ShiftedScene s = make_shifted_scene(rig, {0, 0, 0}, 1.0, random);
    const ShiftStep found = time_shift_step(rig, s.observations, s.seen.T_rig_world, s.twist, unknown(3));
    for (Eigen::Index c = 1; c < 3; ++c, ++count) sum += found.shift_s(c) * found.shift_s(c) / found.variance_s2(c);
  }
  EXPECT_NEAR(sum / count, 1.0, 0.3);
}

TEST(TimeShifts, ThePriorHoldsWhereTheRigIsAtRest) {
  const Rig rig = scene::make_rig(2, scene::Models::kRadTan);
  Random random(5, "shifts");
  const ShiftedScene s = make_shifted_scene(rig, {0, 0}, 1.0, random);
  ShiftPrior prior(2);
  prior.set(1, 1e-6, -0.003);
  const ShiftStep found = time_shift_step(rig, s.observations, s.seen.T_rig_world, Vector6d::Zero(), prior);
  EXPECT_NEAR(found.shift_s(0), 0.0, 1e-7);
  EXPECT_NEAR(found.shift_s(1), 0.003, 1e-9);
  EXPECT_NEAR(found.variance_s2(1), 1e-6, 1e-12);
}

TEST(TimeShifts, AConstantPoseStaysAndItsShiftsAreFound) {
  const Rig rig = scene::make_rig(3, scene::Models::kMixed);
  Random random(6, "shifts");
  const ShiftedScene s = make_shifted_scene(rig, {0.003, -0.002, 0.001}, 0.0, random);
  ShiftPrior prior(3);
  for (std::size_t c = 0; c < 3; ++c) prior.set(c, ShiftPrior::kUnknown_s2);
  const ShiftStep found = time_shift_step(rig, s.observations, s.seen.T_rig_world, s.twist, prior, false);
  EXPECT_TRUE(found.pose.isZero(0));
  EXPECT_NEAR(found.shift_s(0), 0.003, 2e-4);
  EXPECT_NEAR(found.shift_s(1), -0.002, 2e-4);
  EXPECT_NEAR(found.shift_s(2), 0.001, 2e-4);
}

}  // namespace
}  // namespace bslam::solver
