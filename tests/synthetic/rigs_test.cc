#include "synthetic/rigs.h"

#include <gtest/gtest.h>

#include <cmath>

namespace bslam::synthetic {
namespace {

TEST(DefaultRig, HasFourCamerasWithAnOverlappingFrontPair) {
  const camera::Rig rig = default_rig();
  ASSERT_EQ(rig.size(), 4u);
  for (std::size_t c = 0; c < 4; ++c) {
    EXPECT_EQ(rig.camera(c).width, 752);
    EXPECT_EQ(rig.camera(c).height, 480);
    for (const Eigen::Vector2d& corner : {Eigen::Vector2d(0, 0), Eigen::Vector2d(751, 479)}) {
      EXPECT_TRUE(rig.camera(c).unproject(corner).has_value());
    }
  }
  EXPECT_TRUE(rig.overlap(0, 1));
  EXPECT_FALSE(rig.overlap(2, 3));
  EXPECT_NEAR(rig.cam_from_rig(1).translation().norm(), 0.11, 0.01);
}

TEST(DefaultRig, CamerasLookInTheDirectionsOfTheirNames) {
  const camera::Rig rig = default_rig();
  const Eigen::Vector3d expected[] = {{1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  for (std::size_t c = 0; c < 4; ++c) {
    const Eigen::Matrix3d R = rig.body_from_cam(c).matrix3();
    EXPECT_GT(R.col(2).dot(expected[c]), 0.995) << rig.camera(c).name;  // z forward
    EXPECT_GT(R.col(1).dot(-Eigen::Vector3d::UnitZ()), 0.995);          // y down
  }
}

TEST(RingRig, FirstTwoCamerasOverlap) {
  for (int n = 1; n <= 8; ++n) {
    const camera::Rig rig = ring_rig(n, 188);
    EXPECT_EQ(rig.size(), static_cast<std::size_t>(n));
    if (n >= 2) {
      EXPECT_TRUE(rig.overlap(0, 1));
    }
  }
}

TEST(FisheyeRig, ProjectsPointsBehindItsPlane) {
  for (int n = 1; n <= 8; ++n) {
    const camera::Rig rig = fisheye_rig(n);
    EXPECT_EQ(rig.size(), static_cast<std::size_t>(n));
    const double angle = 94.0 * 3.14159265 / 180;
    const auto pixel = rig.camera(std::size_t{0}).project({std::sin(angle), 0, std::cos(angle)});
    ASSERT_TRUE(pixel.has_value());
    EXPECT_TRUE(rig.camera(std::size_t{0}).contains(*pixel));
  }
}

TEST(MixedRig, HasTwoModels) {
  const camera::Rig rig = mixed_rig();
  EXPECT_EQ(camera::model_name(rig.camera(std::size_t{0}).model), "pinhole-radtan");
  EXPECT_EQ(camera::model_name(rig.camera(std::size_t{3}).model), "kannala-brandt");
}

}  // namespace
}  // namespace bslam::synthetic
