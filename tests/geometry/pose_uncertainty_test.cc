#include "geometry/pose_uncertainty.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "random_transforms.h"

namespace bslam::geometry {
namespace {

// Covariance of `samples` errors, drawn with the Cholesky factor L, after `map` was applied to the pose they belong to.
template <class Map>
Matrix6d sampled(const Matrix6d& L, const SE3& T_true, const Map& map) {
  constexpr int kSamples = 40000;
  Random random(1, "covariance");
  Matrix6d sum = Matrix6d::Zero();
  for (int n = 0; n < kSamples; ++n) {
    Vector6d normal;
    for (int i = 0; i < 6; ++i) normal[i] = random.normal();
    const SE3 T = T_true.perturbed(L * normal);
    const Vector6d error = (map(T_true) * map(T).inverse()).log();
    sum += error * error.transpose() / kSamples;
  }
  return sum;
}

void expect_alike(const Matrix6d& found, const Matrix6d& expected) {
  const Vector6d unit = expected.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT((unit.asDiagonal() * (found - expected) * unit.asDiagonal()).cwiseAbs().maxCoeff(), 0.03);
}

class PoseUncertaintyTest : public ::testing::Test {
 protected:
  PoseUncertaintyTest() {
    Matrix6d A;
    for (int i = 0; i < 36; ++i) A(i) = random.normal();
    L = 1e-3 * A;
    of_noise.noise = L * L.transpose();
    of_calibration.calibration = L;
    T_a_world = SE3::exp((Vector6d() << 0.4, -0.2, 0.9, 1, 2, -1).finished());
  }
  Random random{2, "pose covariance"};
  Matrix6d L;
  PoseUncertainty of_noise, of_calibration;  // with the same covariance
  SE3 T_a_world;
};

TEST_F(PoseUncertaintyTest, IsTransportedAsTheErrorsOfSamples) {
  const SE3 T_b_a = SE3::exp((Vector6d() << -0.7, 0.5, 0.1, 0.5, -3, 2).finished());
  const Matrix6d expected = sampled(L, T_a_world, [&](const SE3& T) { return T_b_a * T; });
  for (const PoseUncertainty& from : {of_noise, of_calibration})
    expect_alike(transported(from, T_b_a).covariance(), expected);
}

TEST_F(PoseUncertaintyTest, IsScaledAsTheErrorsOfSamples) {
  const Matrix6d expected = sampled(L, T_a_world, [](const SE3& T) { return scaled(T, 2.5); });
  for (const PoseUncertainty& from : {of_noise, of_calibration}) expect_alike(scaled(from, 2.5).covariance(), expected);
}

// The error of the calibration is the same for both terms, so that it adds as a vector; noise adds as a variance.
TEST_F(PoseUncertaintyTest, SumsOfOneCalibrationErrorAreNotIndependent) {
  const Matrix6d covariance = of_noise.noise;
  EXPECT_LT(((of_noise + of_noise).covariance() - 2 * covariance).norm(), 1e-12 * covariance.norm());
  EXPECT_LT(((of_calibration + of_calibration).covariance() - 4 * covariance).norm(), 1e-12 * covariance.norm());
  EXPECT_LT(((of_noise + of_calibration).covariance() - 2 * covariance).norm(), 1e-12 * covariance.norm());
  EXPECT_LT(((of_calibration + of_noise).covariance() - 2 * covariance).norm(), 1e-12 * covariance.norm());
}

}  // namespace
}  // namespace bslam::geometry
