#include "camera/camera_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/random.h"
#include "camera/test_cameras.h"

namespace bslam::camera {
namespace {

constexpr double kPi = std::numbers::pi;

class CameraModelOf : public testing::TestWithParam<Camera> {};
INSTANTIATE_TEST_SUITE_P(Models, CameraModelOf, testing::ValuesIn(test_cameras()),
                         [](const auto& instance) { return instance.param.name; });

std::vector<Vector2d> pixels_of(const Camera& camera) {
  std::vector<Vector2d> pixels;
  for (int r = 0; r <= 20; ++r) {
    for (int c = 0; c <= 20; ++c) pixels.emplace_back(c * (camera.width - 1) / 20.0, r * (camera.height - 1) / 20.0);
  }
  return pixels;
}

// Points in the model's domain at small and large depths, for wide lenses also behind the image plane.
std::vector<Vector3d> points_of(const Camera& camera, Random random) {
  std::vector<Vector3d> points;
  while (points.size() < 300) {
    const Vector3d direction = Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    const Vector3d point = std::exp(random.uniform(-2.0, 4.0)) * direction;
    const auto pixel = camera.project(point);
    if (pixel && camera.contains(*pixel)) points.push_back(point);
  }
  return points;
}

TEST_P(CameraModelOf, PixelsRoundTripThroughTheirBearing) {
  int valid = 0;
  for (const Vector2d& pixel : pixels_of(GetParam())) {
    const auto bearing = GetParam().unproject(pixel);
    if (!bearing) continue;
    ++valid;
    EXPECT_NEAR(bearing->norm(), 1.0, 1e-12);
    const auto again = GetParam().project(3.7 * *bearing);
    ASSERT_TRUE(again) << pixel.transpose();
    EXPECT_LT((*again - pixel).norm(), 1e-6) << pixel.transpose();
  }
  EXPECT_GT(valid, 400);  // of 441: at most the corners of a fisheye image are outside the domain
}

TEST_P(CameraModelOf, PointsRoundTripUpToTheirDistance) {
  for (const Vector3d& point : points_of(GetParam(), Random(1))) {
    const auto bearing = GetParam().unproject(GetParam().project(point).value());
    ASSERT_TRUE(bearing) << point.transpose();
    EXPECT_LT((*bearing - point.normalized()).norm(), 1e-7) << point.transpose();
  }
}

TEST_P(CameraModelOf, JacobianAgreesWithFiniteDifferences) {
  for (const Vector3d& point : points_of(GetParam(), Random(2))) {
    const auto projection = GetParam().project_with_jacobian(point);
    ASSERT_TRUE(projection);
    EXPECT_LT((projection->pixel - GetParam().project(point).value()).norm(), 1e-9);
    const double step = 1e-6 * point.norm();
    Matrix23d numeric;
    bool inside = true;
    for (int k = 0; k < 3; ++k) {
      const Vector3d e = step * Vector3d::Unit(k);
      const auto plus = GetParam().project(point + e), minus = GetParam().project(point - e);
      inside = inside && plus && minus;
      if (inside) numeric.col(k) = (*plus - *minus) / (2 * step);
    }
    if (!inside) continue;
    EXPECT_LT((projection->jacobian - numeric).norm(), 1e-5 * (1.0 + numeric.norm())) << point.transpose();
  }
}

// The focal length on the optical axis divided by fx of the model. That of the double sphere refers to the second
// sphere centre, and that of the field-of-view model to the radius 1/2.
double magnification_on_axis(const CameraModel& model) {
  if (const auto* sphere = std::get_if<DoubleSphere>(&model)) return 1 / (1 + sphere->distortion()[0]);
  if (const auto* fov = std::get_if<Fov>(&model)) return 2 * std::tan(fov->distortion()[0] / 2) / fov->distortion()[0];
  return 1;
}

TEST_P(CameraModelOf, JacobianIsCorrectOnTheOpticalAxis) {
  const auto projection = GetParam().project_with_jacobian({0, 0, 2.0});
  ASSERT_TRUE(projection);
  const Intrinsics& k = intrinsics(GetParam().model);
  EXPECT_LT((projection->pixel - Vector2d(k.cx, k.cy)).norm(), 1e-9);
  Matrix23d expected;
  const double depth = 2 / magnification_on_axis(GetParam().model);
  expected << k.fx / depth, 0, 0, 0, k.fy / depth, 0;
  EXPECT_NEAR(GetParam().radians_per_pixel(), depth / (k.fx + k.fy), 1e-12);
  EXPECT_LT((projection->jacobian - expected).norm(), 1e-9);
}

TEST_P(CameraModelOf, ProjectionDependsOnDirectionOnly) {
  for (const Vector3d& point : points_of(GetParam(), Random(3))) {
    EXPECT_LT((GetParam().project(point).value() - GetParam().project(7.0 * point).value()).norm(), 1e-8);
  }
}

TEST_P(CameraModelOf, ReturnsNulloptForInvalidInput) {
  const double nan = std::nan("");
  EXPECT_FALSE(GetParam().project({nan, 0, 1}));
  EXPECT_FALSE(GetParam().project({0, 0, nan}));
  EXPECT_FALSE(GetParam().project({0, 0, 0}));
  EXPECT_FALSE(GetParam().project_with_jacobian({0, nan, 1}));
  EXPECT_FALSE(GetParam().project_with_jacobian({0, 0, 0}));
  EXPECT_FALSE(GetParam().unproject({nan, 0}));
  EXPECT_FALSE(GetParam().project({0, 0, -1}));
  EXPECT_FALSE(GetParam().project_with_jacobian({0, 0, -1}));
}

// Of two directions with the same pixel, only one may be projected.
TEST_P(CameraModelOf, NoTwoDirectionsShareAPixel) {
  Random random(4);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d direction = Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    const auto pixel = GetParam().project(direction);
    if (!pixel || !GetParam().contains(*pixel)) continue;
    const auto bearing = GetParam().unproject(*pixel);
    ASSERT_TRUE(bearing) << direction.transpose();
    EXPECT_LT((*bearing - direction).norm(), 1e-6) << direction.transpose();
  }
}

TEST(Pinhole, ProjectsNothingOnOrBehindItsPlane) {
  const Pinhole camera({400, 400, 320, 240});
  EXPECT_FALSE(camera.project({1, 0, 0}));
  EXPECT_FALSE(camera.project({0.1, 0, -1}));
  EXPECT_FALSE(camera.project_with_jacobian({0.1, 0, -1}));
  EXPECT_TRUE(camera.project({5, 0, 0.01}));
}

TEST(PinholeRadTan, DomainEndsAtTheMaximumDistortedRadius) {
  const PinholeRadTan camera({458.654, 457.296, 367.215, 248.375}, {-0.28340811, 0.07395907, 0, 0});
  // r (1 + k1 r^2 + k2 r^4): 1 + 3 k1 r^2 + 5 k2 r^4 has no root here, so the radius increases without limit.
  EXPECT_TRUE(camera.project({1000, 0, 1}));
  const PinholeRadTan barrel({458, 457, 367, 248}, {-0.28, 0, 0, 0});
  const double end = std::sqrt(1 / (3 * 0.28));  // of the radii: 1 + 3 k1 r^2 = 0
  EXPECT_TRUE(barrel.project({end - 0.003, 0, 1}));
  EXPECT_FALSE(barrel.project({end + 0.003, 0, 1}));
  EXPECT_FALSE(barrel.project_with_jacobian({1.2, 0, 1}));
  EXPECT_FALSE(barrel.unproject({367 + 458 * 0.8, 248}));  // beyond the largest distorted radius, 0.727
}

TEST(PinholeRadTan, KeepsItsCoefficients) {
  for (const std::vector<double>& d :
       {std::vector<double>{0.1, 0.2, 0.3, 0.4}, {0.1, 0.2, 0.3, 0.4, 0.5}, {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8}}) {
    EXPECT_EQ(PinholeRadTan({1, 1, 0, 0}, d).distortion(), d);
  }
}

TEST(KannalaBrandt, ProjectsPointsBehindItsPlane) {
  const KannalaBrandt camera({130, 130, 320, 240}, {0, 0, 0, 0});
  for (const double theta : {0.5 * kPi, 0.6 * kPi, 0.9 * kPi, 0.999 * kPi}) {
    const Vector3d direction(std::sin(theta), 0, std::cos(theta));
    EXPECT_LT((camera.project(direction).value() - Vector2d(320 + 130 * theta, 240)).norm(), 1e-9);
    EXPECT_LT((camera.unproject({320 + 130 * theta, 240}).value() - direction).norm(), 1e-9);
  }
}

TEST(KannalaBrandt, DomainEndsAtTheMaximumRadius) {
  const KannalaBrandt camera({130, 130, 320, 240}, {-0.1, 0, 0, 0});  // 1 - 0.3 theta^2 = 0
  const double end = std::sqrt(1 / 0.3);
  const auto at = [](double theta) { return Vector3d(std::sin(theta), 0, std::cos(theta)); };
  EXPECT_TRUE(camera.project(at(end - 0.002)));
  EXPECT_FALSE(camera.project(at(end + 0.002)));
  EXPECT_FALSE(camera.project_with_jacobian(at(end + 0.01)));
  EXPECT_FALSE(camera.unproject({320 + 130 * (end - 0.1 * std::pow(end, 3)) + 1, 240}));
}

TEST(KannalaBrandt, IsSmoothAcrossTheAxis) {
  const KannalaBrandt camera({245, 245, 256, 256}, {0.0158, 0.0269, -0.0457, 0.0072});
  for (const double x : {0.0, 1e-15, 1e-12, 1e-10, 1e-9, 1e-8, 1e-6}) {
    const auto projection = camera.project_with_jacobian({x, -x, 1.5});
    ASSERT_TRUE(projection);
    EXPECT_NEAR(projection->pixel.x(), 256 + 245 * x / 1.5, 1e-9);
    EXPECT_NEAR(camera.project({x, -x, 1.5}).value().y(), 256 - 245 * x / 1.5, 1e-9);
    EXPECT_NEAR(projection->jacobian(0, 0), 245 / 1.5, 1e-6);
    EXPECT_NEAR(projection->jacobian(0, 2), 0.0, 1e-3);
  }
}

Vector3d at_angle(double theta) { return {std::sin(theta), 0, std::cos(theta)}; }

// Largest angle from the axis at which a model projects, by bisection.
template <class Model>
double widest_angle(const Model& model) {
  double inside = 0.0, outside = kPi;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (inside + outside);
    (model.project(at_angle(middle)) ? inside : outside) = middle;
  }
  return inside;
}

TEST(Unified, EqualsMeisModelWithoutDistortion) {
  const double xi = 1.3, gamma = 540;
  const Unified camera({gamma / (1 + xi), gamma / (1 + xi), 320, 240}, xi / (1 + xi));
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    const Vector3d p(random.normal(), random.normal(), random.uniform(0, 2));
    const double divisor = p.z() + xi * p.norm();
    EXPECT_LT(
        (camera.project(p).value() - Vector2d(320 + gamma * p.x() / divisor, 240 + gamma * p.y() / divisor)).norm(),
        1e-10);
  }
}

TEST(Unified, WithAlphaZeroIsAPinhole) {
  const Intrinsics k{400, 410, 320, 240};
  const Unified camera(k, 0.0);
  const Pinhole pinhole(k);
  for (const Vector3d& p : {Vector3d(0.3, -0.2, 1), Vector3d(5, 1, 0.5)}) {
    EXPECT_LT((camera.project(p).value() - pinhole.project(p).value()).norm(), 1e-12);
    const Vector2d pixel = camera.project(p).value();
    EXPECT_LT((camera.unproject(pixel).value() - pinhole.unproject(pixel).value()).norm(), 1e-12);
  }
  EXPECT_FALSE(camera.project({0.1, 0, 0}));
}

TEST(ExtendedUnified, WithBetaOneIsTheUnifiedModel) {
  const Intrinsics k{230, 231, 319, 239};
  const ExtendedUnified extended(k, 0.6, 1.0);
  const DoubleSphere sphere(k, 0.0, 0.6);
  const Unified unified(k, 0.6);
  for (double theta = 0.01; theta < 1.8; theta += 0.1) {
    const Vector2d pixel = unified.project(at_angle(theta)).value();
    EXPECT_LT((extended.project(at_angle(theta)).value() - pixel).norm(), 1e-10);
    EXPECT_LT((sphere.project(at_angle(theta)).value() - pixel).norm(), 1e-10);
    EXPECT_LT((sphere.unproject(pixel).value() - unified.unproject(pixel).value()).norm(), 1e-10);
  }
}

// Equations 40 to 42 of the paper.
TEST(DoubleSphere, AgreesWithThePaper) {
  const double xi = -0.24, alpha = 0.567;
  const DoubleSphere camera({350, 349, 366, 249}, xi, alpha);
  Random random(6);
  for (int i = 0; i < 100; ++i) {
    const Vector3d p(random.normal(), random.normal(), random.uniform(0.1, 2));
    const double d1 = std::sqrt(p.x() * p.x() + p.y() * p.y() + p.z() * p.z());
    const double d2 = std::sqrt(p.x() * p.x() + p.y() * p.y() + std::pow(xi * d1 + p.z(), 2));
    const double n = alpha * d2 + (1 - alpha) * (xi * d1 + p.z());
    EXPECT_LT((camera.project(p).value() - Vector2d(350 * p.x() / n + 366, 349 * p.y() / n + 249)).norm(), 1e-10);
  }
}

TEST(SphereModels, DomainEndsAtTheMaximumRadius) {
  const Intrinsics k{200, 200, 320, 240};
  const Unified wide(k, 0.7);
  EXPECT_NEAR(widest_angle(wide), std::acos(-0.3 / 0.7), 1e-9);  // d r / d theta = 0
  const Unified narrow(k, 0.3);
  EXPECT_NEAR(widest_angle(narrow), std::acos(-0.3 / 0.7), 1e-9);  // the divisor is 0
  for (const double xi : {-0.3, 0.0, 0.4}) {
    for (const double alpha : {0.3, 0.5, 0.65}) {
      const DoubleSphere sphere(k, xi, alpha);
      const double end = widest_angle(sphere);
      double last = 0.0;
      for (double theta = 0.001; theta < end; theta += 0.001) {  // the radius increases over the whole domain
        const double r = sphere.project(at_angle(theta)).value().x() - 320;
        EXPECT_GT(r, last);
        last = r;
      }
      // The paper's bound, -w2, is stricter than the true one.
      const double w1 = alpha > 0.5 ? (1 - alpha) / alpha : alpha / (1 - alpha);
      const double w2 = (w1 + xi) / std::sqrt(2 * w1 * xi + xi * xi + 1);
      EXPECT_GT(end, std::acos(-w2) - 1e-6);
      EXPECT_FALSE(sphere.project_with_jacobian(at_angle(std::min(end + 1e-6, kPi))));
    }
  }
  EXPECT_FALSE(wide.unproject({320 + 200 / std::sqrt(0.4) + 1, 240}));  // r^2 < 1 / (2 alpha - 1)
  EXPECT_TRUE(wide.unproject({320 + 200 / std::sqrt(0.4) - 1, 240}));
}

TEST(CameraModel, ReturnsItsNameAndParameters) {
  const auto cameras = test_cameras();
  EXPECT_EQ(model_name(cameras[0].model), "pinhole");
  EXPECT_EQ(model_name(cameras[1].model), "pinhole-radtan");
  EXPECT_EQ(model_name(cameras[5].model), "kannala-brandt");
  EXPECT_TRUE(distortion(cameras[0].model).empty());
  EXPECT_EQ(distortion(cameras[5].model).size(), 4u);
  EXPECT_EQ(intrinsics(cameras[0].model).fx, 707.0912);
  EXPECT_EQ(model_name(DoubleSphere({1, 1, 0, 0}, 0.1, 0.5)), "double-sphere");
  EXPECT_EQ(distortion(DoubleSphere({1, 1, 0, 0}, 0.1, 0.5)), (std::vector{0.1, 0.5}));
  EXPECT_EQ(model_name(Unified({1, 1, 0, 0}, 0.5)), "ucm");
  EXPECT_EQ(distortion(Unified({1, 1, 0, 0}, 0.5)), (std::vector{0.5}));
  EXPECT_EQ(model_name(ExtendedUnified({1, 1, 0, 0}, 0.5, 1.5)), "eucm");
  EXPECT_EQ(distortion(ExtendedUnified({1, 1, 0, 0}, 0.5, 1.5)), (std::vector{0.5, 1.5}));
}

}  // namespace
}  // namespace bslam::camera
