#include "geometry/sim3.h"

#include <gtest/gtest.h>

#include "geometry/random_transforms.h"

namespace bslam::geometry {
namespace {

Sim3 random_sim3(Random& random) {
  const SE3 T = random_se3(random);
  return Sim3(random.uniform(0.2, 5.0), T.rotation(), T.translation());
}

Eigen::Matrix4d matrix(const Sim3& S) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = S.scale() * S.rotation().toRotationMatrix();
  m.topRightCorner<3, 1>() = S.translation();
  return m;
}

Eigen::Matrix4d exp_by_series(const Vector7d& xi) {
  Eigen::Matrix4d X = Eigen::Matrix4d::Zero();
  X.topLeftCorner<3, 3>() = skew(xi.head<3>()) + xi(6) * Matrix3d::Identity();
  X.topRightCorner<3, 1>() = xi.segment<3>(3);
  Eigen::Matrix4d sum = Eigen::Matrix4d::Identity(), term = sum;
  for (int k = 1; k < 80; ++k) sum += term = term * X / k;
  return sum;
}

Vector7d random_tangent(Random& random) {
  Vector7d xi;
  xi << random_rotation_vector(random), random_vector(random, 5), random.uniform(-2, 2);
  return xi;
}

TEST(Sim3, ComposesLikeItsMatrix) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Sim3 A = random_sim3(random), B = random_sim3(random);
    const Vector3d p = random_vector(random, 3);
    EXPECT_LT(((A * B) * p - A * (B * p)).norm(), 1e-10);
    EXPECT_LT((A.inverse() * (A * p) - p).norm(), 1e-12);
  }
}

TEST(Sim3, FromARigidTransformIsTheSameMap) {
  Random random(2);
  const SE3 T = random_se3(random);
  const Vector3d p = random_vector(random, 3);
  EXPECT_LT((Sim3(T) * p - T * p).norm(), 1e-13);
}

TEST(Sim3, TransformsAPoseWithItsWorld) {
  Random random(3);
  const Sim3 S = random_sim3(random);
  const SE3 T_b_frame = random_se3(random);
  const SE3 T_a_frame = S.apply_to_pose(T_b_frame);
  EXPECT_LT((T_a_frame * Vector3d::Zero() - S * (T_b_frame * Vector3d::Zero())).norm(), 1e-12);
  // Directions of points in the frame are preserved; their distance is scaled.
  const Vector3d p_b = random_vector(random, 3);
  const Vector3d before = T_b_frame.inverse() * p_b, after = T_a_frame.inverse() * (S * p_b);
  EXPECT_LT((after - S.scale() * before).norm(), 1e-11);
}

TEST(Sim3, ExpIsTheMatrixExponential) {
  Random random(4);
  for (const double angle : {0.0, 1e-9, 1e-5, 1e-2, 1.0}) {
    for (const double log_scale : {0.0, 1e-9, 1e-5, 1e-2, 1.0, 2.3}) {  // times up to 2: scales up to 100
      Vector7d xi = random_tangent(random);
      xi.head<3>() *= angle;
      xi(6) *= log_scale;
      const Eigen::Matrix4d expected = exp_by_series(xi);
      EXPECT_LT((matrix(Sim3::exp(xi)) - expected).norm(), 1e-12 * (1 + expected.norm())) << angle << " " << log_scale;
    }
  }
}

TEST(Sim3, LogInvertsExp) {
  Random random(5);
  for (const double size : {0.0, 1e-9, 1e-5, 1e-2, 1.0}) {
    for (int i = 0; i < 20; ++i) {
      const Vector7d xi = size * random_tangent(random);
      EXPECT_LT((Sim3::exp(xi).log() - xi).norm(), 1e-9 * size + 1e-14);
    }
  }
}

TEST(Sim3, WithoutScaleEqualsSE3Bitwise) {
  Random random(6);
  Vector7d xi = random_tangent(random);
  xi(6) = 0.0;
  const Sim3 S = Sim3::exp(xi);
  const SE3 T = SE3::exp(xi.head<6>());
  EXPECT_EQ(S.scale(), 1.0);
  EXPECT_EQ(S.translation(), T.translation());
  EXPECT_EQ(S.rotation().coeffs(), T.rotation().coeffs());
  EXPECT_EQ(S.log().head<6>(), T.log());
}

TEST(Sim3, AdjointTransformsATangent) {
  Random random(7);
  for (int i = 0; i < 50; ++i) {
    const Sim3 S = random_sim3(random);
    const Vector7d xi = 0.5 * random_tangent(random);
    const Eigen::Matrix4d carried = matrix(S * Sim3::exp(xi) * S.inverse());
    EXPECT_LT((carried - matrix(Sim3::exp(S.adjoint() * xi))).norm(), 1e-10 * (1 + carried.norm()));
  }
}

// d (exp(delta) S p) / d delta = [-[S p]x, I, S p].
TEST(Sim3, PerturbedPointHasTheExpectedJacobian) {
  Random random(8);
  const Sim3 S = random_sim3(random);
  const Vector3d p = random_vector(random, 3), q = S * p;
  Eigen::Matrix<double, 3, 7> J;
  J << -skew(q), Matrix3d::Identity(), q;
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 7; ++k) {
    const Vector7d e = kStep * Vector7d::Unit(k);
    const Vector3d numeric = (S.perturbed(e) * p - S.perturbed(-e) * p) / (2 * kStep);
    EXPECT_LT((numeric - J.col(k)).norm(), 1e-7);
  }
}

}  // namespace
}  // namespace bslam::geometry
