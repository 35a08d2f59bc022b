#include "solver/reprojection.h"

#include <gtest/gtest.h>

#include "solver/scene.h"

namespace bslam::solver {
namespace {

using scene::Models;

class ReprojectionJacobian : public testing::TestWithParam<Models> {};

// Central differences of the error over a perturbation on the left, rotation first, and over the point.
TEST_P(ReprojectionJacobian, AgreesWithFiniteDifferences) {
  const Rig rig = scene::make_rig(4, GetParam());
  Random random(3, "jacobian");
  constexpr double kStep = 1e-6;
  for (int trial = 0; trial < 200; ++trial) {
    const SE3 T = SE3::exp(scene::random_twist(random, 1.0, 4.0));
    const Vector3d point = scene::random_visible_point(rig, T, random);
    for (std::size_t i = 0; i < rig.size(); ++i) {
      const CameraIndex camera(i);
      const auto seen = scene::see(rig, i, T, point);
      if (!seen) continue;
      const Vector2d pixel = *seen + Vector2d(2, -3);
      const auto r = ReprojectionResidual::evaluate(rig, camera, T, point, pixel);
      ASSERT_TRUE(r);
      EXPECT_NEAR((r->error - Vector2d(2, -3)).norm(), 0, 1e-9);
      Matrix26d J_pose;
      for (int k = 0; k < 6; ++k) {
        const geometry::Vector6d d = kStep * geometry::Vector6d::Unit(k);
        J_pose.col(k) = (*ReprojectionResidual::error_only(rig, camera, T.perturbed(d), point, pixel) -
                         *ReprojectionResidual::error_only(rig, camera, T.perturbed(-d), point, pixel)) /
                        (2 * kStep);
      }
      Matrix23d J_point;
      for (int k = 0; k < 3; ++k) {
        const Vector3d d = kStep * Vector3d::Unit(k);
        J_point.col(k) = (*ReprojectionResidual::error_only(rig, camera, T, point + d, pixel) -
                          *ReprojectionResidual::error_only(rig, camera, T, point - d, pixel)) /
                         (2 * kStep);
      }
      EXPECT_LT((J_pose - r->J_pose).norm(), 1e-6 * (1 + J_pose.norm()));
      EXPECT_LT((J_point - r->J_point).norm(), 1e-6 * (1 + J_point.norm()));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(EveryModel, ReprojectionJacobian,
                         testing::Values(Models::kPinhole, Models::kRadTan, Models::kFisheye, Models::kMixed));

TEST(ReprojectionResidual, IsEmptyWhereThePointIsBehindAPinhole) {
  const Rig rig = scene::make_rig(1, Models::kPinhole);
  EXPECT_FALSE(ReprojectionResidual::evaluate(rig, CameraIndex(0), SE3(), Vector3d(0, 0, -2), Vector2d(1, 1)));
  EXPECT_FALSE(ReprojectionResidual::error_only(rig, CameraIndex(0), SE3(), Vector3d(0, 0, -2), Vector2d(1, 1)));
}

TEST(ReprojectionResidual, SeesBehindThePlaneOfAFisheye) {
  const Rig rig = scene::make_rig(1, Models::kFisheye);
  EXPECT_TRUE(ReprojectionResidual::evaluate(rig, CameraIndex(0), SE3(), Vector3d(2, 0, -0.2), Vector2d(1, 1)));
}

TEST(Huber, IsQuadraticInsideAndLinearOutside) {
  EXPECT_DOUBLE_EQ(huber_cost(2.0), 2.0);
  EXPECT_DOUBLE_EQ(huber_weight(2.0), 1.0);
  const double knee = std::sqrt(kChi2TwoDof95);
  EXPECT_NEAR(huber_cost(100.0), 2 * knee * 10 - knee * knee, 1e-12);
  EXPECT_NEAR(huber_weight(100.0), knee / 10, 1e-12);
  // The weight is the derivative of the cost by the squared error.
  EXPECT_NEAR((huber_cost(50 + 1e-4) - huber_cost(50 - 1e-4)) / 2e-4, huber_weight(50), 1e-8);
}

}  // namespace
}  // namespace bslam::solver
