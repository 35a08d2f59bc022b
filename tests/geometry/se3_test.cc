#include "geometry/se3.h"

#include <gtest/gtest.h>

#include "geometry/random_transforms.h"

namespace bslam::geometry {
namespace {

double distance(const SE3& a, const SE3& b) { return (a.inverse() * b).log().norm(); }

Eigen::Matrix4d exp_by_series(const Vector6d& xi) {
  Eigen::Matrix4d X = Eigen::Matrix4d::Zero();
  X.topLeftCorner<3, 3>() = skew(xi.head<3>());
  X.topRightCorner<3, 1>() = xi.tail<3>();
  Eigen::Matrix4d sum = Eigen::Matrix4d::Identity(), term = sum;
  for (int k = 1; k < 60; ++k) sum += term = term * X / k;
  return sum;
}

Vector6d random_twist(Random& random, double translation = 5.0) {
  Vector6d xi;
  xi << random_rotation_vector(random), random_vector(random, translation);
  return xi;
}

TEST(SE3, MapsPointsLikeItsMatrix) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const SE3 T = random_se3(random);
    const Vector3d p = random_vector(random, 10);
    EXPECT_LT((T * p - (T.matrix() * p.homogeneous()).head<3>()).norm(), 1e-12);
  }
}

TEST(SE3, ComposesAndInverts) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const SE3 A = random_se3(random), B = random_se3(random);
    EXPECT_LT(((A * B).matrix() - A.matrix() * B.matrix()).norm(), 1e-12);
    EXPECT_LT((A.inverse() * A).log().norm(), 1e-13);
  }
}

TEST(SE3, StaysOrthonormalOverManyProducts) {
  Random random(3);
  const SE3 step = SE3::exp(0.1 * random_twist(random));
  SE3 T;
  for (int i = 0; i < 100000; ++i) T = step * T;
  EXPECT_NEAR(T.rotation().norm(), 1.0, 1e-14);
}

TEST(SE3, ExpIsTheMatrixExponential) {
  Random random(4);
  for (const double scale : {0.0, 1e-9, 1e-5, 1e-4, 1e-2, 1.0}) {
    const Vector6d xi = scale * random_twist(random);
    EXPECT_LT((SE3::exp(xi).matrix() - exp_by_series(xi)).norm(), 1e-11) << scale;
  }
}

TEST(SE3, LogInvertsExp) {
  Random random(5);
  for (const double scale : {0.0, 1e-9, 1e-5, 1e-4, 1e-2, 1.0}) {
    for (int i = 0; i < 20; ++i) {
      const Vector6d xi = scale * random_twist(random);
      EXPECT_LT((SE3::exp(xi).log() - xi).norm(), 1e-9 * scale + 1e-14);
    }
  }
}

TEST(SE3, AdjointTransformsATwist) {
  Random random(6);
  for (int i = 0; i < 50; ++i) {
    const SE3 T = random_se3(random);
    const Vector6d xi = random_twist(random);
    EXPECT_LT(distance(T * SE3::exp(xi) * T.inverse(), SE3::exp(T.adjoint() * xi)), 1e-11);
  }
}

TEST(SE3, PerturbsOnTheLeft) {
  Random random(7);
  const SE3 T = random_se3(random);
  const Vector6d delta = 0.1 * random_twist(random);
  EXPECT_LT(distance(T.perturbed(delta), SE3::exp(delta) * T), 1e-14);
}

// d (exp(delta) T p) / d delta = [-[T p]x, I], the form used by every residual.
TEST(SE3, PerturbedPointHasTheExpectedJacobian) {
  Random random(8);
  const SE3 T = random_se3(random);
  const Vector3d p = random_vector(random, 3), q = T * p;
  Eigen::Matrix<double, 3, 6> J;
  J << -skew(q), Matrix3d::Identity();
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 6; ++k) {
    const Vector6d e = kStep * Vector6d::Unit(k);
    const Vector3d numeric = (T.perturbed(e) * p - T.perturbed(-e) * p) / (2 * kStep);
    EXPECT_LT((numeric - J.col(k)).norm(), 1e-8);
  }
}

TEST(SE3, InterpolatesBetweenItsEnds) {
  Random random(9);
  for (int i = 0; i < 30; ++i) {
    const SE3 a = random_se3(random), b = SE3::exp(0.5 * random_twist(random)) * a;
    EXPECT_LT(distance(interpolate(a, b, 0.0), a), 1e-12);
    EXPECT_LT(distance(interpolate(a, b, 1.0), b), 1e-11);
    const SE3 half = interpolate(a, b, 0.5);
    EXPECT_LT(distance(half * a.inverse() * half, b), 1e-11);  // two equal steps
    EXPECT_LT(distance(interpolate(a, b, 2.0), b * a.inverse() * b), 1e-10);
  }
}

}  // namespace
}  // namespace bslam::geometry
