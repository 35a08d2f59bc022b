#include "estimators/absolute_pose.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "solver/scene.h"

namespace bslam::estimators {

namespace scene = solver::scene;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

using scene::Models;

// Exactly `inliers` of `count` observations are correct, in random order.
scene::PoseScene make_scene(const Rig& rig, int count, int inliers, double noise, Random& random) {
  scene::PoseScene out = scene::make_pose_scene(rig, count, noise, 0.0, random);
  for (std::uint32_t i = static_cast<std::uint32_t>(count) - 1; i > 0; --i) {
    std::swap(out.observations[i], out.observations[random.below(i + 1)]);
  }
  for (int i = inliers; i < count; ++i) {
    solver::PoseObservation& o = out.observations[static_cast<std::size_t>(i)];
    const auto& camera = rig.camera(o.camera);
    const Vector2d right = o.pixel;
    while ((o.pixel - right).norm() < 20) o.pixel = {random.uniform(0, camera.width), random.uniform(0, camera.height)};
    out.outlier[static_cast<std::size_t>(i)] = 1;
  }
  for (std::uint32_t i = static_cast<std::uint32_t>(count) - 1; i > 0; --i) {
    const std::uint32_t j = random.below(i + 1);
    std::swap(out.observations[i], out.observations[j]);
    std::swap(out.outlier[i], out.outlier[j]);
  }
  return out;
}

bool near_truth(const solver::PoseSolution& s, const scene::PoseScene& scene) {
  return scene::rotation_error(s.T_rig_world, scene.T_rig_world) < 0.01 &&
         scene::centre_error(s.T_rig_world, scene.T_rig_world) < 0.1;
}

struct RigCase {
  std::size_t cameras;
  Models models;
};
class AbsolutePoseOnRig : public testing::TestWithParam<RigCase> {};

TEST_P(AbsolutePoseOnRig, SolvesWithFortyInliersOfAHundredAndThirty) {
  const Rig rig = scene::make_rig(GetParam().cameras, GetParam().models);
  Random random(1, "absolute");
  constexpr int kTrials = 60;
  int solved = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto scene = make_scene(rig, 130, 40, 1.0, random);
    const solver::PoseSolution s =
        absolute_pose(rig, scene.observations, {}, {}, Random(2, "t", static_cast<std::uint64_t>(trial)));
    solved += s.ok && near_truth(s, scene);
    EXPECT_TRUE(!s.ok || near_truth(s, scene)) << "a wrong pose must not be accepted, trial " << trial;
  }
  EXPECT_GE(solved, kTrials - 1);
}

TEST_P(AbsolutePoseOnRig, IsExactWithoutNoiseAndOutliers) {
  const Rig rig = scene::make_rig(GetParam().cameras, GetParam().models);
  Random random(3);
  for (int trial = 0; trial < 10; ++trial) {
    const auto scene = make_scene(rig, 40, 40, 0.0, random);
    const solver::PoseSolution s = absolute_pose(rig, scene.observations, {}, {}, Random(1));
    ASSERT_TRUE(s.ok);
    EXPECT_EQ(s.num_inliers, 40);
    EXPECT_LT(scene::rotation_error(s.T_rig_world, scene.T_rig_world), 1e-6);
    EXPECT_LT(scene::centre_error(s.T_rig_world, scene.T_rig_world), 1e-5);
  }
}

TEST_P(AbsolutePoseOnRig, FailsWithOnlyOutliers) {
  const Rig rig = scene::make_rig(GetParam().cameras, GetParam().models);
  Random random(4);
  for (int trial = 0; trial < 40; ++trial) {
    const auto scene = make_scene(rig, 130, 0, 1.0, random);
    EXPECT_FALSE(absolute_pose(rig, scene.observations, {}, {}, Random(1, "t", static_cast<std::uint64_t>(trial))).ok);
  }
}

INSTANTIATE_TEST_SUITE_P(Rigs, AbsolutePoseOnRig,
                         testing::Values(RigCase{1, Models::kPinhole}, RigCase{1, Models::kFisheye},
                                         RigCase{2, Models::kRadTan}, RigCase{2, Models::kFisheye},
                                         RigCase{4, Models::kRadTan}, RigCase{4, Models::kFisheye},
                                         RigCase{5, Models::kMixed}));

// Two cameras in opposite directions, 2 m apart and close to the points: far from a central rig.
TEST(AbsolutePose, SolvesRigsWithLongBaselines) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t i = 0; i < 2; ++i) {
    const geometry::Quaterniond R(Eigen::AngleAxisd(std::numbers::pi * static_cast<double>(i), Vector3d::UnitY()));
    const SE3 T_body_cam(R, Vector3d(0, 0, i == 0 ? 1.0 : -1.0));
    cameras.push_back({camera::Camera{"c", scene::make_model(Models::kPinhole, i), 752, 480, 0, ""}, T_body_cam});
  }
  const Rig rig(std::move(cameras));
  Random random(5);
  int solved = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const auto scene = make_scene(rig, 130, 40, 1.0, random);
    const solver::PoseSolution s =
        absolute_pose(rig, scene.observations, {}, {}, Random(2, "t", static_cast<std::uint64_t>(trial)));
    solved += s.ok && near_truth(s, scene);
  }
  EXPECT_GE(solved, 39);
}

// Two observations of a landmark in both cameras of a stereo rig count as one point.
TEST(AbsolutePose, CountsDistinctPoints) {
  const Rig rig = scene::make_rig(2, Models::kPinhole);
  Random random(6);
  const SE3 T_rig_world = SE3::exp(scene::random_twist(random, 0.5, 2.0));
  std::vector<solver::PoseObservation> observations;
  for (int points = 0; points < 14;) {
    const Vector3d point = scene::random_visible_point(rig, T_rig_world, random);
    const auto left = scene::see(rig, 0, T_rig_world, point), right = scene::see(rig, 1, T_rig_world, point);
    if (!left || !right) continue;
    observations.push_back({CameraIndex(0), point, *left, 1.0});
    observations.push_back({CameraIndex(1), point, *right, 1.0});
    ++points;
  }
  const solver::PoseSolution few = absolute_pose(rig, observations, {}, {}, Random(1));
  EXPECT_EQ(few.num_inliers, 28);
  EXPECT_FALSE(few.ok);
  AbsolutePoseOptions fourteen;
  fourteen.min_inliers = 14;
  EXPECT_TRUE(absolute_pose(rig, observations, {}, fourteen, Random(1)).ok);
}

TEST(AbsolutePose, FailsWithTooFewOrDegenerateObservations) {
  const Rig rig = scene::make_rig(1, Models::kPinhole);
  Random random(7);
  EXPECT_FALSE(absolute_pose(rig, {}, {}, {}, Random(1)).ok);
  const auto scene = make_scene(rig, 20, 20, 0.0, random);
  EXPECT_FALSE(absolute_pose(rig, std::span(scene.observations).first(2), {}, {}, Random(1)).ok);
  std::vector<solver::PoseObservation> one(30, scene.observations[0]);  // the same observation repeated
  EXPECT_FALSE(absolute_pose(rig, one, {}, {}, Random(1)).ok);
  std::vector<solver::PoseObservation> line;
  for (int i = 0; i < 40; ++i) {
    const Vector3d point = (2.0 + 0.5 * i) * Vector3d(0.2, -0.1, 1);
    line.push_back({CameraIndex(0), point, *rig.camera(0).project(point), 1.0});
  }
  EXPECT_FALSE(absolute_pose(rig, line, {}, {}, Random(1)).ok);
}

TEST(AbsolutePose, IsDeterministicInAnyThread) {
  const Rig rig = scene::make_rig(4, Models::kMixed);
  Random random(8);
  const auto scene = make_scene(rig, 130, 40, 1.0, random);
  const auto solve = [&] { return absolute_pose(rig, scene.observations, {}, {}, Random(5)); };
  const solver::PoseSolution expected = solve();
  ASSERT_TRUE(expected.ok);
  std::vector<solver::PoseSolution> found(4);
  {
    std::vector<std::jthread> threads;
    for (solver::PoseSolution& s : found) threads.emplace_back([&] { s = solve(); });
  }
  for (const solver::PoseSolution& s : found) {
    EXPECT_EQ(s.T_rig_world.matrix(), expected.T_rig_world.matrix());
    EXPECT_EQ(s.inlier, expected.inlier);
  }
}

}  // namespace
}  // namespace bslam::estimators
