#include "calibration/rig_warnings.h"

#include <gtest/gtest.h>

#include <numbers>

#include "camera/test_cameras.h"

namespace bslam::calibration {
namespace {

using geometry::SE3;
using geometry::Vector3d;

camera::Camera pinhole() { return {"p", camera::Pinhole({300, 300, 319.5, 239.5}), 640, 480, 0, ""}; }

camera::RigCamera at(const Vector3d& place, double yaw = 0.0) {
  return {pinhole(), SE3(geometry::so3_exp({0, yaw, 0}), place)};
}

// The same rig in a body frame with x up and y to the left, as IMUs are mounted.
camera::Rig mounted(const std::vector<camera::RigCamera>& cameras) {
  geometry::Matrix3d R;
  R << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  std::vector<camera::RigCamera> out;
  for (const camera::RigCamera& c : cameras)
    out.push_back({c.camera, SE3(R, Vector3d(0.02, -0.06, 0.01)) * c.T_body_cam});
  return camera::Rig(std::move(out));
}

bool warns(const camera::Rig& rig, const std::string& part) {
  for (const std::string& warning : rig_warnings(rig)) {
    if (warning.find(part) != std::string::npos) return true;
  }
  return false;
}

camera::Rig one(const camera::Camera& camera) { return camera::Rig({{camera, SE3()}}); }

TEST(RigWarnings, AreEmptyForOrdinaryRigs) {
  EXPECT_TRUE(rig_warnings(mounted({at({0, 0, 0}), at({0.11, 0, 0})})).empty());
  EXPECT_TRUE(rig_warnings(mounted({at({0, 0, 0}), at({-0.1, 0, 0}), at({0.1, 0, -0.1}, 1.57), at({0, 0, -0.2}, 3.14),
                                    at({-0.1, 0, -0.1}, -1.57)}))
                  .empty());
  for (const camera::Camera& camera : camera::test_cameras()) {
    EXPECT_TRUE(rig_warnings(one(camera)).empty()) << camera.name << ": " << rig_warnings(one(camera)).front();
  }
}

TEST(RigWarnings, ReportImplausibleBaselines) {
  EXPECT_TRUE(warns(camera::Rig({at({0, 0, 0}), at({0.0005, 0, 0})}), "0.5 mm apart"));
  EXPECT_TRUE(warns(camera::Rig({at({0, 0, 0}), at({110, 0, 0})}), "millimetres"));
  EXPECT_TRUE(warns(camera::Rig({at({0, 0, 0}), at({0, 0, 0})}), "the same extrinsics"));
  EXPECT_EQ(rig_warnings(camera::Rig({at({0, 0, 0}), at({0.0005, 0, 0}), at({100, 0, 0})})).size(), 2u);
  EXPECT_TRUE(
      warns(camera::Rig({at({0, 0, 0}), at({100, 0, 0}), at({200, 0, 0}), at({300, 0, 0})}),
            "cameras 0 and 1 are 100.00 m apart, and 5 other pairs are too far apart as well: are they millimetres?"));
}

TEST(RigWarnings, ReportImplausibleTimeOffsets) {
  camera::Camera camera = pinhole();
  camera.time_offset_ns = 40'000'000;
  EXPECT_TRUE(rig_warnings(one(camera)).empty());
  camera.time_offset_ns = -20'000'000'000;
  EXPECT_TRUE(warns(one(camera), "a time offset of -20 s: is it given in milliseconds?"));
}

TEST(RigWarnings, ReportIntrinsicsThatDoNotFitTheImage) {
  camera::Camera camera = pinhole();
  camera.width = 300;
  EXPECT_TRUE(warns(one(camera), "is outside of the 300 x 480 image"));
  camera.width = 1280, camera.height = 960;  // the calibration of half the resolution
  EXPECT_TRUE(warns(one(camera), "far from the centre"));
  camera = pinhole();
  camera.model = camera::Pinhole({3000 * 3, 3000 * 3, 319.5, 239.5});
  EXPECT_TRUE(warns(one(camera), "a field of view of 4.1 deg"));
  camera.model = camera::Pinhole({30, 30, 319.5, 239.5});
  EXPECT_TRUE(warns(one(camera), "does the focal length fit 640 x 480"));
  camera.model = camera::Pinhole({300, 500, 319.5, 239.5});
  EXPECT_TRUE(warns(one(camera), "differ unusually"));
  camera.model = camera::PinholeRadTan({300, 300, 319.5, 239.5}, {-0.6, 0, 0, 0});
  EXPECT_TRUE(warns(one(camera), "the camera model is valid for only"));
}

TEST(RigWarnings, ReportInvertedExtrinsics) {
  constexpr const char* kQuestion = "was T_cam_body given instead of T_body_cam";
  const camera::Rig stereo = mounted({at({0, 0, 0}), at({0.11, 0, 0})});
  EXPECT_LT(obstruction(stereo), 0.01);
  EXPECT_TRUE(warns(with_inverse_extrinsics(stereo), kQuestion));
  EXPECT_TRUE(rig_warnings(camera::Rig({at({0, 0, 0}), at({0, 0.11, 0})})).empty());  // actually above each other
  // A ring around the body; inverted, all cameras are at one position.
  std::vector<camera::RigCamera> ring;
  for (int k = 0; k < 4; ++k) {
    const SE3 turn(geometry::so3_exp({0, k * std::numbers::pi / 2, 0}), Vector3d::Zero());
    ring.push_back({pinhole(), turn * SE3(geometry::Quaterniond::Identity(), {0, 0, 0.2})});
  }
  const camera::Rig around(ring);
  EXPECT_TRUE(rig_warnings(around).empty());
  EXPECT_TRUE(warns(with_inverse_extrinsics(around), kQuestion));
}

TEST(RigWarnings, ReportCamerasInEachOthersView) {
  EXPECT_TRUE(warns(camera::Rig({at({0, 0, 0}), at({0, 0, 0.3})}), "the cameras are in the view of each other"));
  const camera::Rig inwards({at({-0.2, 0, 0}, 1.57), at({0.2, 0, 0}, -1.57)});
  EXPECT_GT(obstruction(inwards), 0.9);
  EXPECT_TRUE(warns(inwards, "the cameras are in the view of each other"));
}

}  // namespace
}  // namespace bslam::calibration
