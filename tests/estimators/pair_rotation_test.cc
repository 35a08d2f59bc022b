#include "estimators/pair_rotation.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "geometry/so3.h"

namespace bslam::estimators {
namespace {

// Points 2 - 20 m in front of a pair that is 0.11 m apart, with noise; every `wrong`th match is wrong (0: none).
std::vector<BearingPair> matches_of(const EpipolarPose& truth, double baseline, int wrong, Random& random) {
  std::vector<BearingPair> pairs;
  for (int i = 0; i < 300; ++i) {
    const double depth = random.uniform(2, 20);
    const Eigen::Vector3d in_a(depth * random.uniform(-0.7, 0.7), depth * random.uniform(-0.5, 0.5), depth);
    Eigen::Vector3d in_b = truth.R_b_a * in_a + baseline * truth.t_b_a;
    if (wrong > 0 && i % wrong == 0) in_b = Eigen::Vector3d(random.uniform(-0.7, 0.7), random.uniform(-0.5, 0.5), 1);
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    pairs.push_back({in_a.normalized(), (in_b.normalized() + 5e-4 * noise).normalized()});
  }
  return pairs;
}

TEST(PairRotation, IsFoundAmongWrongMatches) {
  Random random(3);
  for (const Eigen::Vector3d& error_deg :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-2.5, 0, 1), Eigen::Vector3d(4, 0, -3), Eigen::Vector3d(0, 0, 0)}) {
    const EpipolarPose given{geometry::so3_exp({0.01, -0.02, 0.005}).toRotationMatrix(), -Eigen::Vector3d::UnitX()};
    const Eigen::Matrix3d error = geometry::so3_exp(error_deg * geometry::radians(1)).toRotationMatrix();
    const EpipolarPose truth{error * given.R_b_a, error * given.t_b_a};
    const std::vector<BearingPair> pairs = matches_of(truth, 0.11, 4, random);
    const PairRotation found = pair_rotation(given, pairs, {.tolerance = 2e-3});
    const Eigen::Vector3d left =
        geometry::so3_log(Eigen::Quaterniond(found.correction.transpose() * error)) / geometry::radians(1);
    EXPECT_LT(std::abs(left.x()), 0.05) << error_deg.transpose();  // moves points across the epipolar planes
    EXPECT_LT(std::abs(left.z()), 0.05) << error_deg.transpose();
    EXPECT_LT(std::abs(left.y()), 0.6) << error_deg.transpose();  // moves them along: hardly observable
    EXPECT_GT(found.agree, 210);
    if (error_deg.norm() > 0.5) {
      EXPECT_LT(epipolar_agreement(given, pairs, 2e-3).all, 80);
    }
  }
}

// Points across the epipolar planes by y (1 + p x), as by wrong tangential distortion: to 300 matches with independent
// errors, this is a rotation by a degree, which would change all disparities by ten pixels.
TEST(PairRotation, ErrorsOfTheIntrinsicsAreNotTakenForARotationThatChangesDisparities) {
  Random random(5);
  const EpipolarPose given{Eigen::Matrix3d::Identity(), -Eigen::Vector3d::UnitX()};
  for (const double focal_error : {0.0, 0.02}) {
    const Eigen::Vector3d error_deg(0.5, 0, 0.5);
    const Eigen::Matrix3d error = geometry::so3_exp(error_deg * geometry::radians(1)).toRotationMatrix();
    std::vector<BearingPair> pairs = matches_of({error, error * given.t_b_a}, 0.11, 4, random);
    for (BearingPair& pair : pairs) {
      const double x = pair.b.x() / pair.b.z(), y = pair.b.y() / pair.b.z();
      pair.b = Eigen::Vector3d((1 + focal_error) * x, (1 + focal_error) * y + 0.015 * x * y, 1).normalized();
    }
    const PairRotation found = pair_rotation(given, pairs, {.tolerance = 4e-3});
    const Eigen::Vector3d left =
        geometry::so3_log(Eigen::Quaterniond(found.correction.transpose() * error)) / geometry::radians(1);
    EXPECT_LT(std::abs(left.x()), 0.05) << focal_error;
    EXPECT_LT(std::abs(left.z()), 0.1) << focal_error;
    EXPECT_LT(std::abs(left.y()), 0.05) << focal_error;
  }
}

TEST(PairRotation, OneThatChangesDisparitiesIsFoundIfItIsLarge) {
  Random random(6);
  const EpipolarPose given{Eigen::Matrix3d::Identity(), -Eigen::Vector3d::UnitX()};
  const Eigen::Matrix3d error = geometry::so3_exp(Eigen::Vector3d(0.02, 0.08, 0)).toRotationMatrix();
  const auto pairs = matches_of({error, error * given.t_b_a}, 0.11, 0, random);
  const PairRotation found = pair_rotation(given, pairs, {.tolerance = 3e-3});
  EXPECT_LT(geometry::so3_log(Eigen::Quaterniond(found.correction.transpose() * error)).norm(), 0.01);
}

// A camera turned outwards sees far points behind itself, which shows by how much it is turned.
TEST(PairRotation, BringsPointsBehindTheCamerasToInfinity) {
  Random random(7);
  for (const double turn_deg : {0.5, 0.75, 1.0}) {
    const Eigen::Matrix3d error =
        geometry::so3_exp(Eigen::Vector3d::UnitY() * geometry::radians(turn_deg)).toRotationMatrix();
    const EpipolarPose given{Eigen::Matrix3d::Identity(), -Eigen::Vector3d::UnitX()};
    const auto pairs = matches_of({error, error * given.t_b_a}, 0.11, 10, random);
    const PairRotation found = pair_rotation(given, pairs, {.tolerance = 1.5e-3});
    const Eigen::Vector3d left =
        geometry::so3_log(Eigen::Quaterniond(found.correction.transpose() * error)) / geometry::radians(1);
    EXPECT_TRUE(found.brought_to_front);
    EXPECT_LT(left.norm(), 0.35 * turn_deg + 0.1) << turn_deg;
    EXPECT_GT(found.agree, 250);
  }
}

// At one side of the image it brings far points behind the cameras, by more than their disparities.
TEST(PairRotation, AWrongFocalLengthIsNotTakenForARotationThatBringsPointsBehindTheCameras) {
  Random random(9);
  const EpipolarPose given{Eigen::Matrix3d::Identity(), -Eigen::Vector3d::UnitX()};
  std::vector<BearingPair> pairs = matches_of(given, 0.11, 10, random);
  for (BearingPair& pair : pairs) {
    const double x = pair.b.x() / pair.b.z(), y = pair.b.y() / pair.b.z();
    pair.b = Eigen::Vector3d(1.03 * x, 1.03 * y, 1).normalized();
  }
  const PairRotation found = pair_rotation(given, pairs, {.tolerance = 2e-3});
  EXPECT_LT(geometry::so3_log(Eigen::Quaterniond(found.correction)).norm(), geometry::radians(0.15));
}

TEST(PairRotation, DoesNotChangeDisparitiesIfNoPointIsBehindTheCameras) {
  Random random(8);
  const EpipolarPose given{Eigen::Matrix3d::Identity(), -Eigen::Vector3d::UnitX()};
  const PairRotation found = pair_rotation(given, matches_of(given, 0.11, 5, random), {.tolerance = 2e-3});
  EXPECT_FALSE(found.brought_to_front);
  EXPECT_LT(geometry::so3_log(Eigen::Quaterniond(found.correction)).norm(), 1e-3);
}

// Exchanged cameras satisfy the epipolar geometry, but with points behind them.
TEST(PairRotation, PointsBehindTheCamerasDoNotAgree) {
  Random random(4);
  const EpipolarPose given{Eigen::Matrix3d::Identity(), -Eigen::Vector3d::UnitX()};
  std::vector<BearingPair> pairs = matches_of(given, 0.2, 0, random);
  EXPECT_GT(pair_rotation(given, pairs, {.tolerance = 2e-3}).with_depth, 250);
  for (BearingPair& pair : pairs) std::swap(pair.a, pair.b);
  EXPECT_LT(pair_rotation(given, pairs, {.tolerance = 2e-3}).with_depth, 25);
  for (BearingPair& pair : pairs) pair.b = pair.a;  // the same image twice
  EXPECT_EQ(pair_rotation(given, pairs, {.tolerance = 2e-3}).with_depth, 0);
}

TEST(PairRotation, RemainsAsGivenWithoutMatches) {
  const PairRotation found = pair_rotation({}, {}, {});
  EXPECT_EQ(found.correction, Eigen::Matrix3d::Identity());
  EXPECT_EQ(found.agree, 0);
}

}  // namespace
}  // namespace bslam::estimators
