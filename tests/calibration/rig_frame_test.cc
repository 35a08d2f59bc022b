#include "calibration/rig_frame.h"

#include <gtest/gtest.h>

#include <cmath>

#include "synthetic/rigs.h"

namespace bslam::calibration {
namespace {

using geometry::SE3;

camera::Camera with_centre(camera::Camera camera, double dx, double dy) {
  camera::ModelParameters p = camera::parameters(camera.model);
  p(2) += dx;
  p(3) += dy;
  camera.model = camera::with_parameters(camera.model, p);
  return camera;
}

TEST(RigFrame, AMovedPrincipalPointTurnsTheRays) {
  const camera::Camera calibrated = synthetic::default_rig().camera(0);
  const double f = camera::parameters(calibrated.model)(0);
  const SE3 turn = turn_of_rays(with_centre(calibrated, 0.01 * f, 0), calibrated);
  const Eigen::Vector3d angle = geometry::so3_log(turn.rotation());
  // A ray of the refined camera has a smaller x: a negative angle about y. Less than 0.01 rad, because the same shift
  // is a smaller angle away from the centre.
  EXPECT_NEAR(angle.y(), -0.0095, 0.001);
  EXPECT_NEAR(angle.x(), 0, 1e-3);
  EXPECT_NEAR(angle.z(), 0, 1e-3);
  EXPECT_LT(geometry::so3_log(turn_of_rays(calibrated, calibrated).rotation()).norm(), 1e-12);
}

TEST(RigFrame, RigWithAnotherFrameKeepsItsCamerasApart) {
  const camera::Rig rig = synthetic::default_rig();
  const SE3 T(geometry::so3_exp({0.01, 0.02, -0.03}), Eigen::Vector3d::Zero());
  const camera::Rig turned = with_rig_frame(rig, T, rig.body_from_rig());
  EXPECT_TRUE(turned.cam_from_rig(0).matrix().isApprox(T.matrix(), 1e-12));
  EXPECT_TRUE(turned.body_from_rig().matrix().isApprox(rig.body_from_rig().matrix(), 1e-12));
  EXPECT_TRUE((turned.cam_from_rig(1) * turned.rig_from_cam(0)).matrix().isApprox(rig.cam_from_rig(1).matrix(), 1e-12));
  EXPECT_TRUE((turned.body_from_cam(0) * T).matrix().isApprox(rig.body_from_cam(0).matrix(), 1e-12));
}

TEST(RigFrame, MovingAProblemKeepsPixelsAndFixedPoses) {
  const camera::Rig rig = synthetic::default_rig();
  const SE3 before(geometry::so3_exp({0, 0.004, 0}), Eigen::Vector3d::Zero());
  const SE3 after(geometry::so3_exp({0.002, 0.01, 0}), Eigen::Vector3d::Zero());
  RigProblem problem;
  problem.group = {0, 0, 2, 2};
  for (int i = 0; i < 4; ++i) {
    Eigen::Matrix<double, 6, 1> xi;
    xi << 0.1 * i, -0.05, 0.02 * i, 0.5 * i, 0.1, -0.2;
    problem.selected.problem.T_rig_world.push_back(SE3::exp(xi));
    const Eigen::Vector3d point =
        problem.selected.problem.T_rig_world.back().inverse() * Eigen::Vector3d(0.3, 0.2, 4.0 + i);
    problem.selected.problem.points.push_back(point);
    problem.selected.problem.observations.push_back(
        {.pose = i, .point = i, .camera = CameraIndex(std::size_t{0}), .pixel = Eigen::Vector2f::Zero(), .sigma = 1});
  }
  RigProblem moved = problem;
  move_to_rig_frame(after, before, moved);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d in_cam0 = after * (moved.selected.problem.T_rig_world[i] * moved.selected.problem.points[i]);
    EXPECT_TRUE(in_cam0.isApprox(Eigen::Vector3d(0.3, 0.2, 4.0 + static_cast<double>(i)), 1e-9)) << i;
  }
  for (const std::size_t fixed : {0u, 2u}) {  // as in the map
    const SE3 in_map = before.inverse() * problem.selected.problem.T_rig_world[fixed];
    EXPECT_TRUE(moved.selected.problem.T_rig_world[fixed].matrix().isApprox(in_map.matrix(), 1e-9)) << fixed;
  }
}

}  // namespace
}  // namespace bslam::calibration
