#include "geometry/triangulation.h"

#include <gtest/gtest.h>

#include <numbers>
#include <vector>

#include "geometry/random_transforms.h"

namespace bslam::geometry {
namespace {

TEST(Triangulation, FindsThePointOfExactRays) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Vector3d point = random_vector(random, 5);
    std::vector<Ray> rays;
    for (int k = 0; k < 2 + i % 4; ++k) {
      const Vector3d origin = random_vector(random, 5);
      rays.push_back({origin, (point - origin).normalized()});
    }
    const auto found = triangulate_midpoint(rays, 1e-3);
    ASSERT_TRUE(found);
    EXPECT_LT((*found - point).norm(), 1e-9);
  }
}

TEST(Triangulation, ReturnsTheMidpointOfSkewRays) {
  const std::vector<Ray> rays = {{{0, 0, 0}, {0, 0, 1}}, {{1, 0.2, 2}, {-1, 0, 0}}};
  EXPECT_LT((triangulate_midpoint(rays, 1e-3).value() - Vector3d(0, 0.1, 2)).norm(), 1e-12);
}

TEST(Triangulation, ReturnsNulloptForParallelRays) {
  const std::vector<Ray> rays = {{{0, 0, 0}, {0, 0, 1}}, {{1, 0, 0}, {0, 0, 1}}};
  EXPECT_FALSE(triangulate_midpoint(rays, 1e-4));
  EXPECT_FALSE(triangulate_midpoint(rays, 0.0));
  EXPECT_FALSE(triangulate_midpoint(std::vector<Ray>{rays[0]}, 1e-4));
}

TEST(Triangulation, ReturnsNulloptBehindAnOrigin) {
  const Vector3d point(0, 0, 5);
  const std::vector<Ray> rays = {{{-1, 0, 0}, (point - Vector3d(-1, 0, 0)).normalized()},
                                 {{1, 0, 0}, -(point - Vector3d(1, 0, 0)).normalized()}};
  EXPECT_FALSE(triangulate_midpoint(rays, 1e-3));
}

TEST(AngleBetween, IsExactNearZeroAndPi) {
  EXPECT_EQ(angle_between(Vector3d::UnitX(), Vector3d::UnitX()), 0.0);
  EXPECT_EQ(angle_between(Vector3d::UnitX(), -Vector3d::UnitX()), std::numbers::pi);
  const double tiny = 1e-10;
  EXPECT_NEAR(angle_between(Vector3d::UnitX(), Vector3d(std::cos(tiny), std::sin(tiny), 0)), tiny, 1e-20);
}

}  // namespace
}  // namespace bslam::geometry
