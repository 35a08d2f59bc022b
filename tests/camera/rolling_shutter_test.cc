#include "camera/rolling_shutter.h"

#include <gtest/gtest.h>

#include <array>

#include "camera/rig.h"

namespace bslam::camera {
namespace {

using geometry::SE3;
using geometry::Vector6d;

Camera rolling_camera(double readout_s) {
  Camera camera{"rolling", Pinhole({300, 300, 319.5, 239.5}), 640, 480, 0, ""};
  camera.readout_s = readout_s;
  return camera;
}

// Exposure of a row of that camera with a readout of 20 ms, minus the exposure of the middle row, in seconds.
double row_delay_s(double y) { return 0.02 * (y / 479 - 0.5); }

const Vector6d kTwist = (Vector6d() << 0.5, -0.9, 0.3, 0.8, -0.4, 1.1).finished();
const SE3 kCamRig = SE3::exp((Vector6d() << 0.2, 0.5, -0.3, 0.1, -0.2, 0.05).finished());

TEST(Shutter, MiddleRowsAreExposedAtTheTimeOfTheImage) {
  const Camera camera = rolling_camera(0.02);
  const Shutter shutter(camera, kCamRig, kTwist);
  EXPECT_TRUE(shutter.rolling());
  EXPECT_NEAR(shutter.delay_s(239.5), 0.0, 1e-15);
  EXPECT_NEAR(shutter.delay_s(0), -0.01, 1e-15);
  EXPECT_NEAR(shutter.delay_s(479), 0.01, 1e-15);
  for (const double y : {0.0, 100.0, 479.0}) EXPECT_NEAR(shutter.delay_s(y), row_delay_s(y), 1e-15);
}

TEST(Shutter, MovesPointsLikeTheRig) {
  const Camera camera = rolling_camera(0.02);
  const Shutter shutter(camera, kCamRig, kTwist);
  const Vector3d point_rig(0.4, -0.3, 3.0);
  for (const double y : {0.0, 77.5, 479.0}) {
    const Vector3d exact = kCamRig * (SE3::exp(row_delay_s(y) * kTwist) * point_rig);
    EXPECT_LT((shutter.at_row(kCamRig * point_rig, y) - exact).norm(), 2e-6);
    EXPECT_LT((shutter.pose_at_row(kCamRig, y) * point_rig - exact).norm(), 1e-12);
  }
}

TEST(Shutter, RotatesBearingsToTheMiddleRow) {
  const Shutter shutter(rolling_camera(0.02), kCamRig, kTwist);
  const Vector3d far_point = 1e9 * Vector3d(0.2, 0.1, 1.0).normalized();
  const Vector3d seen = shutter.pose_at_row(SE3(), 30.0) * far_point;
  EXPECT_LT((shutter.bearing_at_middle(seen.normalized(), 30.0) - far_point.normalized()).norm(), 1e-8);
}

TEST(Shutter, ProjectsIntoTheRowThatSeesThePoint) {
  const Camera camera = rolling_camera(0.03);
  const Shutter shutter(camera, kCamRig, kTwist);
  for (const Vector3d& point : {Vector3d(0.5, -1.2, 2.5), Vector3d(-1, 1, 2), Vector3d(0.1, 0.4, 1)}) {
    const auto pixel = project(camera, shutter, point);
    ASSERT_TRUE(pixel);
    EXPECT_LT((*camera.project(shutter.at_row(point, pixel->y())) - *pixel).norm(), 1e-3);
    EXPECT_GT((*camera.project(point) - *pixel).norm(), 0.05);
  }
}

TEST(Shutter, AGlobalShutterOrARigAtRestChangesNothing) {
  const Vector3d point(0.3, 0.2, 2.0);
  for (const Shutter& shutter : {Shutter(), Shutter(rolling_camera(0), kCamRig, kTwist),
                                 Shutter(rolling_camera(0.02), kCamRig, Vector6d::Zero())}) {
    EXPECT_FALSE(shutter.rolling());
    EXPECT_EQ(shutter.at_row(point, 3.0), point);
    EXPECT_EQ(shutter.bearing_at_middle(point, 3.0), point);
    EXPECT_EQ(shutter.pose_at_row(kCamRig, 3.0).matrix(), kCamRig.matrix());
  }
}

TEST(Rig, MovesRollingShuttersFromTheCaptureTimesOfTheirImages) {
  const Rig rig({{rolling_camera(0), SE3()}, {rolling_camera(0.02), kCamRig.inverse()}});
  EXPECT_FALSE(rig.shutter(1).rolling());
  const Rig moving = rig.moving(std::array{0.0, 0.013}, kTwist);
  EXPECT_FALSE(moving.shutter(0).rolling());
  const SE3 exact = kCamRig * SE3::exp((0.013 + 0.01) * kTwist);
  EXPECT_LT((moving.cam_from_rig(CameraIndex(1), 479).matrix() - exact.matrix()).norm(), 1e-12);
}

}  // namespace
}  // namespace bslam::camera
