// The field-of-view model. What holds for every model is in camera_model_test.cc.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/random.h"
#include "camera/camera_model.h"

namespace bslam::camera {
namespace {

const Intrinsics kPlain{400, 410, 320, 240};

// r_d = atan(2 r_u tan(w / 2)) / w.
TEST(Fov, AgreesWithThePaper) {
  Random random(1);
  for (const double w : {0.2, 0.9, 1.7, 3.0}) {
    const Fov camera(kPlain, w);
    for (int i = 0; i < 50; ++i) {
      const Vector3d p(random.normal(), random.normal(), random.uniform(0.1, 2));
      const Vector2d m = p.head<2>() / p.z();
      const Vector2d expected = std::atan(2 * m.norm() * std::tan(w / 2)) / w * m.normalized();
      const Vector2d pixel = camera.project(p).value();
      EXPECT_LT((pixel - Vector2d(320 + 400 * expected.x(), 240 + 410 * expected.y())).norm(), 1e-9) << w;
    }
  }
}

TEST(Fov, KeepsTheRadiusOfOneHalf) {
  for (const double w : {0.001, 0.5, 1.5, 3.0}) {
    const Fov camera(kPlain, w);
    EXPECT_NEAR(camera.project({0.5, 0, 1}).value().x(), 320 + 200, 1e-9) << w;
    EXPECT_LT((camera.unproject({320 + 200, 240}).value() - Vector3d(0.5, 0, 1).normalized()).norm(), 1e-12) << w;
  }
}

TEST(Fov, WithTheSmallestParameterIsAPinhole) {
  const Fov camera(kPlain, 1e-6);
  const Pinhole pinhole(kPlain);
  for (const Vector3d& p : {Vector3d(0.3, -0.2, 1), Vector3d(5, 1, 0.5), Vector3d(0, 0, 2)}) {
    const Projection ours = camera.project_with_jacobian(p).value();
    const Projection plain = pinhole.project_with_jacobian(p).value();
    EXPECT_LT((ours.pixel - plain.pixel).norm(), 1e-6);
    EXPECT_LT((ours.jacobian - plain.jacobian).norm(), 1e-6);
    EXPECT_LT((camera.unproject(plain.pixel).value() - p.normalized()).norm(), 1e-9);
  }
}

TEST(Fov, SeesNothingOnOrBehindItsPlane) {
  const Fov camera(kPlain, 1.0);
  EXPECT_FALSE(camera.project({1, 0, 0}));
  EXPECT_FALSE(camera.project({0.1, 0, -1}));
  EXPECT_FALSE(camera.project_with_jacobian({0.1, 0, -1}));
  EXPECT_TRUE(camera.project({5, 0, 0.01}));
  const double end = 0.5 * std::numbers::pi;  // the distorted radius of an infinite one, with w = 1
  EXPECT_TRUE(camera.unproject({320 + 400 * (end - 0.001), 240}));
  EXPECT_FALSE(camera.unproject({320 + 400 * (end + 0.001), 240}));
  EXPECT_FALSE(camera.unproject({320, 240 - 410 * 2 * end}));
}

TEST(Fov, IsSmoothAcrossTheAxis) {
  const double w = 1.3, focal = 400 * 2 * std::tan(w / 2) / w;
  const Fov camera(kPlain, w);
  for (const double x : {0.0, 1e-15, 1e-12, 1e-10, 1e-9, 1e-8, 1e-6}) {
    const auto projection = camera.project_with_jacobian({x, -x, 1.5});
    ASSERT_TRUE(projection);
    EXPECT_NEAR(projection->pixel.x(), 320 + focal * x / 1.5, 1e-9);
    EXPECT_NEAR(projection->jacobian(0, 0), focal / 1.5, 1e-6);
    EXPECT_NEAR(projection->jacobian(0, 1), 0.0, 1e-6);
    EXPECT_LT((camera.unproject(projection->pixel).value() - Vector3d(x, -x, 1.5).normalized()).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace bslam::camera
