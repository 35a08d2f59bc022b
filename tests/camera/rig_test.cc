#include "camera/rig.h"

#include <gtest/gtest.h>

#include <array>
#include <numbers>

#include "base/random.h"
#include "camera/test_cameras.h"

namespace bslam::camera {
namespace {

using geometry::SE3;

constexpr double kPi = std::numbers::pi;

Camera pinhole(const std::string& name) { return {name, Pinhole({300, 300, 319.5, 239.5}), 640, 480, 0, ""}; }

SE3 rotated(double yaw, const Vector3d& position) { return SE3(geometry::so3_exp({0, yaw, 0}), position); }

double difference(const SE3& a, const SE3& b) { return (a.inverse() * b).log().norm(); }

// A stereo pair facing forward and one camera facing backward, with a separate body frame.
Rig three_cameras() {
  const SE3 T_body_rig(geometry::so3_exp({0.3, -1.2, 0.5}), {0.1, 0.2, 0.3});
  return Rig({{pinhole("left"), T_body_rig},
              {pinhole("right"), T_body_rig * rotated(0, {0.11, 0, 0})},
              {pinhole("back"), T_body_rig * rotated(kPi, {0, 0, -0.2})}});
}

TEST(Rig, ComposesCameraPoses) {
  const Rig rig = three_cameras();
  for (std::size_t i = 0; i < rig.size(); ++i) {
    EXPECT_LT(difference(rig.body_from_cam(i), rig.body_from_cam(0) * rig.rig_from_cam(i)), 1e-13);
    EXPECT_LT(difference(rig.cam_from_rig(i).inverse(), rig.rig_from_cam(i)), 1e-13);
    EXPECT_EQ(&rig.cam_from_rig(i), &rig.cam_from_rig(CameraIndex(i)));
  }
  EXPECT_LT((rig.rig_from_cam(1).translation() - Vector3d(0.11, 0, 0)).norm(), 1e-13);
  // A point in front of camera 0 is behind the camera that faces backward.
  EXPECT_LT(((rig.cam_from_rig(2) * Vector3d(0, 0, 1)) - Vector3d(0, 0, -1.2)).norm(), 1e-12);
}

TEST(Rig, Camera0IsTheRigFrameExactly) {
  const Rig rig = three_cameras();
  EXPECT_EQ(rig.cam_from_rig(std::size_t{0}).matrix(), Eigen::Matrix4d::Identity());
  EXPECT_EQ(rig.rig_from_cam(0).matrix(), Eigen::Matrix4d::Identity());
}

TEST(Rig, MeasuresOverlapOfStereo) {
  const Rig rig = three_cameras();
  EXPECT_TRUE(rig.overlap(0, 1));
  EXPECT_TRUE(rig.overlap(1, 0));
  EXPECT_GT(rig.overlap_share(0, 1), 0.95);
  EXPECT_TRUE(rig.any_overlap());
}

TEST(Rig, OppositeCamerasDoNotOverlap) {
  const Rig rig = three_cameras();
  for (const std::size_t front : {0u, 1u}) {
    EXPECT_FALSE(rig.overlap(front, 2));
    EXPECT_FALSE(rig.overlap(2, front));
  }
  const std::array apart = {0, 2};
  EXPECT_FALSE(rig.subset(apart).any_overlap());
}

// Two cameras side by side, rotated apart by an angle; their fields of view are 93.7 degrees wide.
TEST(Rig, OverlapShrinksWithTheAngleBetweenCameras) {
  double last = 1.1;
  for (const double degrees : {0.0, 30.0, 60.0, 85.0, 120.0}) {
    const Rig rig({{pinhole("a"), SE3()}, {pinhole("b"), rotated(degrees * kPi / 180, {0, 0, 0})}});
    EXPECT_LT(rig.overlap_share(0, 1), last);
    last = rig.overlap_share(0, 1);
    EXPECT_EQ(rig.overlap(0, 1), degrees < 90) << degrees;
  }
  EXPECT_EQ(last, 0.0);
}

TEST(Rig, WideFisheyesOverlapSideways) {
  const Camera fisheye = test_cameras().back();
  const Rig rig({{fisheye, SE3()}, {fisheye, rotated(kPi / 2, {0.05, 0, 0})}, {fisheye, rotated(kPi, {0, 0, -0.1})}});
  EXPECT_TRUE(rig.overlap(0, 1));
  EXPECT_TRUE(rig.overlap(0, 2));  // 220 degrees, back to back: the fields of view overlap in a ring
}

TEST(Rig, SubsetKeepsTheOrderAndMovesTheRigFrame) {
  const Rig rig = three_cameras();
  const std::array order = {2, 0};
  const Rig chosen = rig.subset(order);
  ASSERT_EQ(chosen.size(), 2u);
  EXPECT_EQ(chosen.camera(std::size_t{0}).name, "back");
  EXPECT_EQ(chosen.camera(CameraIndex(1)).name, "left");
  EXPECT_LT(difference(chosen.cam_from_rig(std::size_t{1}), rig.cam_from_rig(std::size_t{0}) * rig.rig_from_cam(2)),
            1e-13);
  EXPECT_LT(difference(chosen.body_from_cam(0), rig.body_from_cam(2)), 1e-15);
}

TEST(Rig, ReplacesTheExtrinsicsOfSomeCameras) {
  const Rig rig = three_cameras();
  const std::array order = {2, 0};
  const SE3 moved = rig.body_from_cam(0) * rotated(0.1, {0.01, 0.02, 0.03});
  const Rig part({{rig.camera(std::size_t{2}), rig.body_from_cam(2)}, {rig.camera(std::size_t{0}), moved}});
  const Rig found = rig.with_calibration_of(part, order);
  EXPECT_EQ(found.camera(std::size_t{0}).name, rig.camera(std::size_t{0}).name);
  EXPECT_LT(difference(found.body_from_cam(0), moved), 1e-15);
  EXPECT_LT(difference(found.body_from_cam(1), rig.body_from_cam(1)), 1e-15);
  EXPECT_LT(difference(found.body_from_cam(2), rig.body_from_cam(2)), 1e-15);
}

TEST(Rig, KeepsTheTurnOfARefinedFirstCamera) {
  const Rig rig = three_cameras();
  const SE3 turn = rotated(0.01, Vector3d::Zero());
  const Rig part({{rig.camera(std::size_t{0}), rig.body_from_cam(0) * turn.inverse()},
                  {rig.camera(std::size_t{1}), rig.body_from_cam(1)}},
                 turn);
  const std::array order = {0, 1};
  const Rig found = rig.with_calibration_of(part, order);
  EXPECT_LT(difference(found.cam_from_rig(0), turn), 1e-15);
  EXPECT_LT(difference(found.body_from_rig(), rig.body_from_rig()), 1e-15);
  // The poses of a run that begins with camera 0 are those of the frame that has not turned.
  EXPECT_LT(difference(found.body_from_first(0), rig.body_from_cam(0)), 1e-15);
  EXPECT_LT(difference(found.rig_from_first(2), rig.rig_from_cam(2)), 1e-15);
}

TEST(Rig, ReplacesTheTimingOfSomeCameras) {
  const Rig rig = three_cameras();
  Camera late = rig.camera(std::size_t{2});
  late.time_offset_ns = 4'000'000;
  late.readout_s = 0.015;
  const std::array order = {2};
  const Rig found = rig.with_calibration_of(Rig({{late, rig.body_from_cam(2)}}), order);
  EXPECT_EQ(found.camera(std::size_t{2}).time_offset_ns, 4'000'000);
  EXPECT_EQ(found.camera(std::size_t{2}).readout_s, 0.015);
  EXPECT_EQ(found.camera(std::size_t{0}).time_offset_ns, rig.camera(std::size_t{0}).time_offset_ns);
}

// Camera 1 was moved twice and camera 0 once.
Rig moved_rig() {
  const auto turn = [](double angle, double shift) {
    return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitY())), Vector3d(shift, 0, 0));
  };
  return three_cameras().with_moves(
      {{1, 300, turn(0.02, 0.003)}, {1, 100, turn(0.01, 0)}, {0, 200, turn(0.03, 0.001)}});
}

TEST(Rig, HasTheExtrinsicsOfEveryTime) {
  const Rig rig = moved_rig();
  ASSERT_EQ(rig.moves().size(), 3u);
  EXPECT_EQ(rig.moves()[0].time_ns, 100);  // in order of time
  for (const TimeNs t : {99, 100, 199, 200, 299, 300}) {
    const Rig then = rig.at(t);
    SE3 before_1, before_0;
    for (const CameraMove& move : rig.moves()) {
      if (move.time_ns <= t) (move.camera == 1 ? before_1 : before_0) = move.T_after_initial;
    }
    EXPECT_LT(difference(then.cam_from_rig(1), before_1 * rig.cam_from_rig(1)), 1e-15) << t;
    EXPECT_LT(difference(then.cam_from_rig(0), before_0), 1e-15) << t;
    EXPECT_TRUE(then.moves().empty());
    EXPECT_LT(difference(then.rig_from_cam(1), then.cam_from_rig(1).inverse()), 1e-15) << t;
    EXPECT_LT(difference(then.cam_from_rig(2), rig.cam_from_rig(2)), 1e-15) << t;
    EXPECT_LT(difference(rig.cam_from_rig_at(1, t), then.cam_from_rig(1)), 1e-15) << t;
  }
}

TEST(Rig, AfterItsMovesHasTheSameCamerasInTheBody) {
  const Rig rig = moved_rig(), after = rig.after_moves(), last = rig.at(300);
  EXPECT_TRUE(after.moves().empty());
  for (std::size_t i = 0; i < rig.size(); ++i)
    EXPECT_LT(difference(after.body_from_cam(i), rig.body_from_rig() * last.rig_from_cam(i)), 1e-14) << i;
  for (std::size_t i = 1; i < rig.size(); ++i)
    EXPECT_LT(difference(after.cam_from_rig(i) * after.rig_from_cam(0), last.cam_from_rig(i) * last.rig_from_cam(0)),
              1e-14);
  EXPECT_LT(after.cam_from_rig(0).translation().norm(), 1e-15);  // only turned, as in rig files
}

TEST(Rig, MovesBelongToTheirCameras) {
  const Rig rig = moved_rig();
  const Rig part = rig.subset(std::array{2, 1});
  ASSERT_EQ(part.moves().size(), 2u);
  EXPECT_EQ(part.moves()[1].camera, 1u);
  const Rig other = rig.subset(std::array{1, 2});
  ASSERT_EQ(other.moves().size(), 2u);
  EXPECT_EQ(other.moves()[0].camera, 0u);
  EXPECT_TRUE(rig.subset(std::array{2}).moves().empty());
  EXPECT_EQ(three_cameras().with_calibration_of(other, std::array{1, 2}).moves()[1].camera, 1u);
  EXPECT_EQ(rig.in_frame_of_camera_0().moves().size(), 3u);
  EXPECT_FALSE(rig.same_calibration(three_cameras()));
  EXPECT_TRUE(rig.same_calibration(moved_rig()));
}

TEST(Rig, OneCameraOverlapsNothing) {
  const Rig rig({{pinhole("only"), SE3()}});
  EXPECT_EQ(rig.size(), 1u);
  EXPECT_FALSE(rig.any_overlap());
}

TEST(RigDeathTest, RequiresACamera) { EXPECT_DEATH(Rig({}), "at least one camera"); }

TEST(Camera, ContainsPixelsUpToItsMargin) {
  const Camera camera = pinhole("c");
  EXPECT_TRUE(camera.contains({0, 0}));
  EXPECT_TRUE(camera.contains({639, 479}));
  EXPECT_FALSE(camera.contains({639.01, 479}));
  EXPECT_FALSE(camera.contains({-0.01, 5}));
  EXPECT_FALSE(camera.contains({5, 5}, 6));
  EXPECT_FALSE(camera.contains({std::nan(""), 5}));
}

TEST(Camera, PixelsSpanTheInverseOfTheFocalLength) { EXPECT_DOUBLE_EQ(pinhole("c").radians_per_pixel(), 1.0 / 300); }

}  // namespace
}  // namespace bslam::camera
