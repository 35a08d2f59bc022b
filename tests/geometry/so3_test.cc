#include "geometry/so3.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <numbers>

#include "geometry/random_transforms.h"

namespace bslam::geometry {
namespace {

constexpr double kPi = std::numbers::pi;
// Angles on both sides of the switch between series and closed form, and near pi.
constexpr double kAngles[] = {0.0,    1e-300,  1e-12, 1e-8, 5e-5, 9.99e-5, 1.01e-4,
                              9.9e-4, 1.01e-3, 0.1,   1.0,  2.0,  3.0,     kPi - 1e-6};

// The power series of the exponential, summed to convergence.
Matrix3d exp_by_series(const Vector3d& omega) {
  const Matrix3d W = skew(omega);
  Matrix3d sum = Matrix3d::Identity(), term = Matrix3d::Identity();
  for (int k = 1; k < 60; ++k) sum += term = term * W / k;
  return sum;
}

// J_l = sum W^k / (k + 1)!
Matrix3d left_jacobian_by_series(const Vector3d& omega) {
  const Matrix3d W = skew(omega);
  Matrix3d sum = Matrix3d::Identity(), term = Matrix3d::Identity();
  for (int k = 1; k < 60; ++k) sum += term = term * W / (k + 1);
  return sum;
}

TEST(So3, SkewIsTheCrossProduct) {
  Random random(1);
  const Vector3d a = random_vector(random, 3), b = random_vector(random, 3);
  EXPECT_TRUE((skew(a) * b).isApprox(a.cross(b)));
}

TEST(So3, ExpIsTheMatrixExponential) {
  Random random(2);
  for (const double angle : kAngles) {
    const Vector3d omega = angle * random_direction(random);
    EXPECT_LT((so3_exp(omega).toRotationMatrix() - exp_by_series(omega)).norm(), 1e-14) << angle;
  }
}

TEST(So3, LogInvertsExp) {
  Random random(3);
  for (const double angle : kAngles) {
    for (int i = 0; i < 20; ++i) {
      const Vector3d omega = angle * random_direction(random);
      EXPECT_LT((so3_log(so3_exp(omega)) - omega).norm(), 1e-14 + 1e-15 * angle) << angle;
    }
  }
}

TEST(So3, LogReturnsTheSmallerAngleForBothSignsOfAQuaternion) {
  Random random(4);
  for (int i = 0; i < 100; ++i) {
    const Vector3d omega = random_rotation_vector(random);
    Quaterniond q = so3_exp(omega);
    q.coeffs() *= -1.0;
    EXPECT_LT((so3_log(q) - omega).norm(), 1e-12);
  }
}

TEST(So3, LogOfARotationByPiHasNormPi) {
  Random random(5);
  for (int i = 0; i < 50; ++i) {
    const Vector3d axis = random_direction(random);
    const Quaterniond q(0.0, axis.x(), axis.y(), axis.z());
    EXPECT_NEAR(so3_log(q).norm(), kPi, 1e-14);
    EXPECT_NEAR(std::abs(so3_log(q).normalized().dot(axis)), 1.0, 1e-14);
  }
}

TEST(So3, LeftJacobianEqualsItsSeries) {
  Random random(6);
  for (const double angle : kAngles) {
    const Vector3d omega = angle * random_direction(random);
    // The closed form loses digits to cancellation just above its threshold.
    EXPECT_LT((so3_left_jacobian(omega) - left_jacobian_by_series(omega)).norm(), 1e-11) << angle;
  }
}

TEST(So3, LeftJacobianMovesThePerturbationToTheLeft) {
  Random random(7);
  for (int i = 0; i < 50; ++i) {
    const Vector3d omega = random_rotation_vector(random), d = 1e-6 * random_direction(random);
    const Vector3d moved = so3_log(so3_exp(omega + d) * so3_exp(omega).conjugate());
    EXPECT_LT((moved - so3_left_jacobian(omega) * d).norm(), 5e-12);
  }
}

TEST(So3, LeftJacobianInverseInverts) {
  Random random(8);
  for (const double angle : kAngles) {
    const Vector3d omega = angle * random_direction(random);
    EXPECT_LT((so3_left_jacobian_inverse(omega) * so3_left_jacobian(omega) - Matrix3d::Identity()).norm(), 1e-9)
        << angle;
  }
}

}  // namespace
}  // namespace bslam::geometry
