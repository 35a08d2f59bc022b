#include "solver/reprojection.h"

#include <gtest/gtest.h>

#include "solver/scene.h"

namespace bslam::solver {
namespace {

using scene::Models;

std::vector<camera::CameraModel> every_model() {
  const camera::Intrinsics k{220, 221, 374, 238};
  return {camera::Pinhole({420, 422, 376, 240}),
          camera::PinholeRadTan({458, 457, 367, 248}, {-0.28, 0.074, 2e-4, 2e-5}),
          camera::KannalaBrandt(k, {0.01, -0.004, 0.002, -0.0005}),
          camera::Unified(k, 0.6),
          camera::ExtendedUnified(k, 0.57, 1.1),
          camera::DoubleSphere(k, -0.2, 0.58),
          camera::Fov(k, 0.9)};
}

// Jacobian of the prediction by central differences of the error, which is the observation minus the prediction.
template <int N, class Error>
Eigen::Matrix<double, 2, N> numeric_jacobian(const Error& error) {
  constexpr double kStep = 1e-6;
  Eigen::Matrix<double, 2, N> J;
  for (int k = 0; k < N; ++k) {
    const Eigen::Matrix<double, N, 1> d = kStep * Eigen::Matrix<double, N, 1>::Unit(k);
    J.col(k) = -(error(d) - error(-d)) / (2 * kStep);
  }
  return J;
}

class ResidualOfModel : public testing::TestWithParam<std::size_t> {};

// The error is pixel minus projection, and the Jacobians agree with differences.
TEST_P(ResidualOfModel, AgreesWithFiniteDifferences) {
  const camera::CameraModel model = every_model()[GetParam()];
  Random random(5, "residual");
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3d q(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(1.5, 8));
    const SE3 T = SE3::exp(scene::random_twist(random, 0.2, 0.3));
    const Vector2d pixel(random.uniform(0, 700), random.uniform(0, 400));
    const auto r = residual(model, T * q, pixel);
    if (!r) continue;
    EXPECT_LT((r->error - *residual_error(model, T * q, pixel)).norm(), 1e-9);
    const auto J = numeric_jacobian<3>([&](const Vector3d& d) { return *residual_error(model, T * q + d, pixel); });
    EXPECT_LT((J - r->J).norm(), 1e-6 * (1 + J.norm()));
    const auto J_pose = numeric_jacobian<6>(
        [&](const geometry::Vector6d& d) { return *residual_error(model, T.perturbed(d) * q, pixel); });
    EXPECT_LT((J_pose - pose_jacobian_transposed(r->J, T * q).transpose()).norm(), 1e-6 * (1 + J_pose.norm()));
  }
}

INSTANTIATE_TEST_SUITE_P(EveryModel, ResidualOfModel, testing::Range(std::size_t{0}, every_model().size()));

class ReprojectionJacobian : public testing::TestWithParam<Models> {};

TEST_P(ReprojectionJacobian, AgreesWithFiniteDifferences) {
  const Rig rig = scene::make_rig(4, GetParam());
  Random random(3, "jacobian");
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
      const auto error_at = [&](const SE3& pose, const Vector3d& p) {
        return *ReprojectionResidual::error_only(rig, camera, pose, p, pixel);
      };
      const auto J_pose =
          numeric_jacobian<6>([&](const geometry::Vector6d& d) { return error_at(T.perturbed(d), point); });
      const auto J_point = numeric_jacobian<3>([&](const Vector3d& d) { return error_at(T, point + d); });
      EXPECT_LT((J_pose + r->J_pose).norm(), 1e-6 * (1 + J_pose.norm()));
      EXPECT_LT((J_point + r->J_point).norm(), 1e-6 * (1 + J_point.norm()));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(EveryModel, ReprojectionJacobian,
                         testing::Values(Models::kPinhole, Models::kRadTan, Models::kFisheye, Models::kMixed));

TEST(ReprojectionResidual, IsEmptyForAPointBehindAPinhole) {
  const Rig rig = scene::make_rig(1, Models::kPinhole);
  EXPECT_FALSE(ReprojectionResidual::evaluate(rig, CameraIndex(0), SE3(), Vector3d(0, 0, -2), Vector2d(1, 1)));
  EXPECT_FALSE(ReprojectionResidual::error_only(rig, CameraIndex(0), SE3(), Vector3d(0, 0, -2), Vector2d(1, 1)));
}

TEST(ReprojectionResidual, ProjectsPointsBehindTheImagePlaneOfAFisheye) {
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
