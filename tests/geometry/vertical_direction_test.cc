#include "geometry/vertical_direction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace bslam::geometry {
namespace {

// A camera that looks horizontally, in a world whose z points upward, turned by `yaw`.
SE3 level_camera(double yaw) {
  Matrix3d R;  // columns: right, down, forward
  R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return {Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) * R, Vector3d(1, 2, 3)};
}

// Poses of a camera that turns around the world's z axis, tilted downward.
std::vector<SE3> turning_camera(double tilt, double turn) {
  std::vector<SE3> poses;
  for (int i = 0; i < 36; ++i) {
    const Eigen::AngleAxisd yaw(turn * i / 36, Vector3d::UnitZ()), down(tilt, Vector3d::UnitX());
    const Eigen::AngleAxisd forward(-std::numbers::pi / 2, Vector3d::UnitX());  // z of the camera is y of the world
    poses.emplace_back(Eigen::Quaterniond(yaw * forward * down), Vector3d(std::cos(i), std::sin(i), 0));
  }
  return poses;
}

TEST(VerticalDirection, IsThatOfUprightImages) {
  EXPECT_LT((vertical_direction({}) - Vector3d(0, -1, 0)).norm(), 1e-12);
  EXPECT_LT((vertical_direction(turning_camera(0, 0)) - Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((vertical_direction(turning_camera(0, 2 * std::numbers::pi)) - Vector3d::UnitZ()).norm(), 1e-12);
}

TEST(VerticalDirection, IsTheAxisAboutWhichATiltedCameraTurns) {
  for (const double tilt : {-0.9, 0.9})
    EXPECT_LT((vertical_direction(turning_camera(tilt, 2 * std::numbers::pi)) - Vector3d::UnitZ()).norm(), 1e-9);
}

TEST(UprightAxes, AreForwardLeftAndUp) {
  std::vector<SE3> poses;
  for (const double yaw : {0.4, 0.5, 0.6}) poses.push_back(level_camera(yaw));
  const SE3 T = upright_axes(poses);
  EXPECT_LT((T.rotation() * Vector3d::UnitZ() - Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((T.rotation() * poses[0].matrix3().col(2) - Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_LT((T.rotation() * -poses[0].matrix3().col(0) - Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_EQ(T.translation(), Vector3d::Zero());
  EXPECT_NEAR(T.matrix3().determinant(), 1, 1e-12);
}

TEST(UprightAxes, OfACameraWithoutPosesAreThoseOfItsAxes) {
  const SE3 T = upright_axes({});
  EXPECT_LT((T * Vector3d::UnitZ() - Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_LT((T * Vector3d(0, -1, 0) - Vector3d::UnitZ()).norm(), 1e-12);
}

TEST(UprightAxes, OfACameraThatLooksUpHaveItsRightAsForward) {
  std::vector<SE3> poses;  // looks along the vertical, turning about it
  for (int i = 0; i < 20; ++i) poses.emplace_back(so3_exp(Vector3d(0, 0, 0.3 * i)), Vector3d::Zero());
  const SE3 T = upright_axes(poses);
  EXPECT_NEAR(std::abs((T * Vector3d::UnitZ()).z()), 1, 1e-9);
  EXPECT_LT((T * Vector3d::UnitX() - Vector3d::UnitX()).norm(), 1e-9);
}

}  // namespace
}  // namespace bslam::geometry
