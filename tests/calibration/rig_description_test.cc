#include "calibration/rig_description.h"

#include <gtest/gtest.h>

#include <numbers>

namespace bslam::calibration {
namespace {

TEST(RigDescription, DescribesDisplacements) {
  EXPECT_EQ(displacement_in_words({0.11, 0, 0}), "11.0 cm to the right");
  EXPECT_EQ(displacement_in_words({-1.2, 0.02, -0.3}), "1.20 m to the left, 30.0 cm behind, 2.0 cm below");
  EXPECT_EQ(displacement_in_words({0, -0.005, 0.001}), "5.0 mm above, 1.0 mm in front");
  EXPECT_EQ(displacement_in_words({0, 0, 0}), "at the same position");
}

TEST(RigDescription, MeasuresFieldsOfView) {
  const camera::Camera pinhole{"p", camera::Pinhole({50, 50, 49.5, 39.5}), 100, 80, 0, ""};
  const FieldOfView view = field_of_view(pinhole);
  EXPECT_NEAR(view.horizontal, 2 * std::atan(49.5 / 50), 1e-9);
  EXPECT_NEAR(view.vertical, 2 * std::atan(39.5 / 50), 1e-9);
  EXPECT_NEAR(view.diagonal, 2 * std::atan(std::hypot(49.5, 39.5) / 50), 1e-9);
  const camera::Camera wide{"w", camera::KannalaBrandt({130, 130, 319.5, 239.5}, {0, 0, 0, 0}), 640, 480, 0, ""};
  EXPECT_NEAR(field_of_view(wide).horizontal, 2 * 319.5 / 130, 1e-9);  // 281 degrees: more than half the sphere
}

// Two cameras side by side, the second one rotated about its optical axis.
camera::Rig rolled(double degrees) {
  const camera::Camera camera{"p", camera::Pinhole({50, 50, 49.5, 39.5}), 100, 80, 0, ""};
  const Eigen::AngleAxisd roll(degrees / 180 * std::numbers::pi, Eigen::Vector3d::UnitZ());
  return camera::Rig({{camera, {}}, {camera, geometry::SE3(Eigen::Quaterniond(roll), {0.1, 0, 0})}});
}

TEST(RigDescription, TellsARotationAboutTheOpticalAxis) {
  const auto contains = [](double degrees, const char* words) {
    return describe_rig(rolled(degrees)).find(words) != std::string::npos;
  };
  EXPECT_TRUE(contains(180, "same viewing direction, rolled 180.0 deg (its image is upside down)"));
  EXPECT_TRUE(contains(20, "same viewing direction, rolled 20.0 deg clockwise"));
  EXPECT_TRUE(contains(-90, "rolled 90.0 deg counter-clockwise"));
  EXPECT_FALSE(contains(0.5, "rolled"));
}

}  // namespace
}  // namespace bslam::calibration
