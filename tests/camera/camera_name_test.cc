#include "camera/camera_name.h"

#include <gtest/gtest.h>

namespace bslam::camera {
namespace {

Rig named(const std::string& first, const std::string& second) {
  const auto pinhole = [](const std::string& name) {
    return Camera{name, Pinhole({300, 300, 319.5, 239.5}), 640, 480, 0, ""};
  };
  return Rig({{pinhole(first), geometry::SE3()}, {pinhole(second), geometry::SE3()}});
}

TEST(CameraName, NumberOfACameraIsUsedWhereNoCameraHasTheName) {
  EXPECT_EQ(camera_named("right", named("left", "right")), 1u);
  EXPECT_EQ(camera_named("cam1", named("left", "right")), 1u);
  EXPECT_EQ(camera_named("cam1", named("cam1", "cam0")), 0u);
  EXPECT_EQ(camera_named("cam2", named("left", "right")), std::nullopt);
}

TEST(CameraName, FrameOfATrajectoryIsThatOfCamera0UnlessItNamesAnother) {
  EXPECT_EQ(camera_of_frame("", named("left", "right")), 0u);
  EXPECT_EQ(camera_of_frame("cam0", named("cam1", "cam0")), 0u);  // a run calls its camera 0 so, whatever its name
  EXPECT_EQ(camera_of_frame("right", named("left", "right")), 1u);
  EXPECT_EQ(camera_of_frame("body", named("left", "right")), std::nullopt);
}

}  // namespace
}  // namespace bslam::camera
