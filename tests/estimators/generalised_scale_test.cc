// Compares the estimated distance between two frames of a rig with the truth of random scenes.
#include "estimators/generalised_scale.h"

#include <gtest/gtest.h>

#include "solver/scene.h"

namespace bslam::estimators {

namespace scene = solver::scene;
using camera::Rig;
using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::SE3;

namespace {

constexpr double kSigma = 1e-3;  // rad, standard deviation of a bearing

Vector3d noisy(const Vector3d& bearing, Random& random) {
  return (bearing + kSigma * Vector3d(random.normal(), random.normal(), random.normal())).normalized();
}

// Matches of every camera, `outlier_ratio` of them anywhere in view.
std::vector<CameraPairs> see_twice(const Rig& rig, const SE3& T_b_a, int count, double outlier_ratio, Random& random) {
  std::vector<CameraPairs> out;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    CameraPairs camera{rig.cam_from_rig(i), {}};  // camera 0 is the reference
    while (camera.pairs.size() < static_cast<std::size_t>(count)) {
      const Vector3d direction(random.uniform(-0.7, 0.7), random.uniform(-0.5, 0.5), 1.0);
      const Vector3d point = random.uniform(1.5, 6.0) * direction.normalized();
      const Vector3d moved = rig.cam_from_rig(i) * (T_b_a * (rig.rig_from_cam(i) * point));
      const bool outlier = random.uniform() < outlier_ratio;
      const Vector3d elsewhere = (moved.normalized() + 0.1 * scene::random_direction(random)).normalized();
      camera.pairs.push_back(
          {noisy(point.normalized(), random), outlier ? elsewhere : noisy(moved.normalized(), random)});
    }
    out.push_back(camera);
  }
  return out;
}

// The motion estimated from one camera: unit length, with small errors.
SE3 up_to_scale(const SE3& T_b_a, Random& random) {
  const SE3 off = T_b_a.perturbed(scene::random_twist(random, 5e-4, 5e-3 * T_b_a.translation().norm()));
  return {off.rotation(), off.translation().normalized()};
}

// Number of pairs whose Sampson angle to the epipolar plane is smaller than `angle`, rad.
int num_agreeing(const SE3& T_b_a, std::span<const CameraPairs> cameras, double angle) {
  int sum = 0;
  for (const CameraPairs& camera : cameras) {
    const SE3 T = camera.T_cam_ref * T_b_a * camera.T_cam_ref.inverse();
    for (const BearingPair& pair : camera.pairs) {
      const Vector3d x = T.rotation() * pair.a, t = T.translation(), by_a = t.cross(x).cross(pair.b),
                     by_b = pair.b.cross(t).cross(x);
      sum += std::abs(pair.b.dot(t.cross(x))) < angle * std::sqrt(by_a.squaredNorm() + by_b.squaredNorm());
    }
  }
  return sum;
}

TEST(GeneralisedScale, EstimatesTheDistanceOfARotatingRig) {
  const Rig rig = scene::make_rig(3, scene::Models::kRadTan);
  double squared_z = 0.0;
  constexpr int kSeeds = 40;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), "turning");
    const SE3 T_b_a = SE3::exp(scene::random_twist(random, 0.2, 0.3));
    const auto cameras = see_twice(rig, T_b_a, 300, 0.1, random);
    const auto found = generalised_scale(up_to_scale(T_b_a, random), cameras);
    ASSERT_TRUE(found.has_value()) << "seed " << seed;
    const double ratio = found->T_b_a.translation().norm() / T_b_a.translation().norm();
    const double z = (ratio - 1.0) / found->deviation;
    EXPECT_LT(std::abs(z), 5.0) << "seed " << seed << ": " << ratio << " +- " << found->deviation;
    EXPECT_LT(found->deviation, 0.1);
    EXPECT_LT(scene::rotation_error(found->T_b_a, T_b_a), 1e-3);
    EXPECT_GT(num_agreeing(found->T_b_a, cameras, 2e-3), 700);
    squared_z += z * z;
  }
  EXPECT_GT(squared_z / kSeeds, 0.4);  // the deviation is realistic
  EXPECT_LT(squared_z / kSeeds, 2.5);
}

// From one distance only, the refinement ends in a motion a hundred times too small for some of them.
TEST(GeneralisedScale, EstimatesTheDistanceFromAPoorMotion) {
  const Rig rig = scene::make_rig(3, scene::Models::kRadTan);
  for (int seed = 0; seed < 20; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), "poor motion");
    const SE3 T_b_a = SE3::exp(scene::random_twist(random, 0.1, 0.5));
    const auto cameras = see_twice(rig, T_b_a, 300, 0.1, random);
    const SE3 poor = T_b_a.perturbed(scene::random_twist(random, 3e-3, 0.2 * T_b_a.translation().norm()));
    const auto found = generalised_scale(poor, cameras);
    ASSERT_TRUE(found.has_value()) << "seed " << seed;
    const double ratio = found->T_b_a.translation().norm() / T_b_a.translation().norm();
    EXPECT_LT(std::abs(std::log(ratio)), 5.0 * found->deviation) << "seed " << seed;
    EXPECT_LT(std::abs(std::log(ratio)), 1.5) << "seed " << seed;
  }
}

TEST(GeneralisedScale, IsNotObservableWithoutRotation) {
  const Rig rig = scene::make_rig(3, scene::Models::kRadTan);
  for (int seed = 0; seed < 20; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), "straight");
    const SE3 T_b_a(Eigen::Quaterniond::Identity(), 0.3 * scene::random_direction(random));
    const auto found = generalised_scale(up_to_scale(T_b_a, random), see_twice(rig, T_b_a, 300, 0.1, random));
    EXPECT_TRUE(!found || found->deviation > 0.3) << "seed " << seed << ": " << found->deviation;
  }
}

TEST(GeneralisedScale, IsNotObservableWithCamerasAtOnePosition) {
  Random random(1, "one place");
  const Rig rig = scene::make_rig(1, scene::Models::kRadTan);
  const SE3 T_b_a = SE3::exp(scene::random_twist(random, 0.2, 0.3));
  const auto found = generalised_scale(up_to_scale(T_b_a, random), see_twice(rig, T_b_a, 300, 0.0, random));
  EXPECT_TRUE(!found || found->deviation > 1.0);
  EXPECT_FALSE(generalised_scale(SE3(), {}).has_value());
}

}  // namespace
}  // namespace bslam::estimators
