#include "matching/point_estimation.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "base/random.h"

namespace bslam::matching {
namespace {

using Eigen::Vector3d;
using geometry::SE3;

const camera::Camera kPinhole{"pinhole", camera::Pinhole({400, 400, 319.5, 239.5}), 640, 480, 0, ""};
const camera::Camera kFisheye{
    "fisheye", camera::KannalaBrandt({190, 190, 319.5, 319.5}, {-0.02, 0.004, -8e-4, 5e-5}), 640, 640, 0, ""};

PointObservation observe(const camera::Camera& camera, const SE3& T_common_cam, const Vector3d& point, double sigma,
                         Random& random) {
  PointObservation o{&camera, T_common_cam.inverse(), {}, {}, sigma};
  o.pixel = *camera.project(o.T_cam_common * point) + sigma * Eigen::Vector2d(random.normal(), random.normal());
  o.bearing = *camera.unproject(o.pixel);
  return o;
}

SE3 at(double x, double y, double z, double yaw = 0) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitY())), Vector3d(x, y, z)};
}

TEST(EstimatePoint, ErrorsMatchTheCovariance) {
  Random random(1, "points");
  double sum = 0;
  constexpr int kPoints = 400;
  for (int i = 0; i < kPoints; ++i) {
    const Vector3d truth(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(2, 4));
    const PointObservation observations[] = {observe(kPinhole, at(0, 0, 0), truth, 0.5, random),
                                             observe(kPinhole, at(0.5, 0, 0), truth, 1.0, random),
                                             observe(kFisheye, at(-0.3, 0.2, 0, 0.7), truth, 0.7, random)};
    const auto estimated = estimate_point(observations, 1e-3);
    ASSERT_TRUE(estimated.has_value());
    const Vector3d error = estimated->point - truth;
    const double e = error.dot(estimated->covariance.ldlt().solve(error));
    EXPECT_LT(e, 30.0);
    sum += e;
    EXPECT_GT(estimated->parallax, 0.05);
    EXPECT_LT(estimated->parallax, 0.5);
  }
  EXPECT_NEAR(sum / kPoints, 3.0, 0.5);  // the mean of chi-square with three degrees of freedom
}

TEST(EstimatePoint, IsExactWithoutNoise) {
  Random random(2, "points");
  const Vector3d truth(0.3, -0.2, 3);
  PointObservation observations[] = {observe(kPinhole, at(0, 0, 0), truth, 0, random),
                                     observe(kPinhole, at(0.2, 0, 0), truth, 0, random)};
  for (PointObservation& o : observations) o.sigma = 1;
  const auto estimated = estimate_point(observations, 1e-3);
  ASSERT_TRUE(estimated.has_value());
  EXPECT_LT((estimated->point - truth).norm(), 1e-8);
  EXPECT_LT(estimated->worst_chi2, 1e-12);
}

TEST(EstimatePoint, ReportsTheObservationWithTheLargestError) {
  Random random(3, "points");
  const Vector3d truth(0.3, -0.2, 3);
  std::vector<PointObservation> observations;
  for (int i = 0; i < 5; ++i) observations.push_back(observe(kPinhole, at(0.15 * i, 0.05 * i, 0), truth, 0.5, random));
  observations[3].pixel.y() += 15;
  observations[3].bearing = *kPinhole.unproject(observations[3].pixel);
  const auto estimated = estimate_point(observations, 1e-3);
  ASSERT_TRUE(estimated.has_value());
  EXPECT_EQ(estimated->worst, 3u);
  EXPECT_GT(estimated->worst_chi2, 100);
}

TEST(EstimatePoint, FailsForParallelRaysPointsBehindAndSingleViews) {
  Random random(4, "points");
  const Vector3d far(0, 0, 1000), near(0, 0, 2);
  const PointObservation parallel[] = {observe(kPinhole, at(0, 0, 0), far, 0, random),
                                       observe(kPinhole, at(0.1, 0, 0), far, 0, random)};
  EXPECT_FALSE(estimate_point(parallel, 1e-3).has_value());
  EXPECT_FALSE(estimate_point(std::span(parallel, 1), 0.0).has_value());
  EXPECT_FALSE(estimate_point({}, 0.0).has_value());
  // Rays that meet behind: the two pixels exchanged.
  PointObservation behind[] = {observe(kPinhole, at(0, 0, 0), near, 1e-9, random),
                               observe(kPinhole, at(0.3, 0, 0), near, 1e-9, random)};
  std::swap(behind[0].pixel, behind[1].pixel);
  std::swap(behind[0].bearing, behind[1].bearing);
  EXPECT_FALSE(estimate_point(behind, 1e-3).has_value());
}

}  // namespace
}  // namespace bslam::matching
