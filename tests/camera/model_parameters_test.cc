#include "camera/model_parameters.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "camera/test_cameras.h"

namespace bslam::camera {
namespace {

// A point in front of the camera that it sees.
Vector3d visible_point(const Camera& camera, Random& random) {
  for (;;) {
    const Vector2d pixel(random.uniform() * camera.width, random.uniform() * camera.height);
    const auto bearing = camera.unproject(pixel);
    if (bearing && bearing->z() > 0.05) return (1 + 5 * random.uniform()) * *bearing;
  }
}

TEST(ModelParameters, AModelIsRestoredFromItsParameters) {
  for (const Camera& camera : test_cameras()) {
    const ModelParameters p = parameters(camera.model);
    EXPECT_EQ(static_cast<std::size_t>(p.size()), parameter_names(camera.model).size()) << camera.name;
    EXPECT_EQ(p.size(), 4 + static_cast<Eigen::Index>(distortion(camera.model).size())) << camera.name;
    const CameraModel again = with_parameters(camera.model, p);
    EXPECT_EQ(again.index(), camera.model.index()) << camera.name;
    EXPECT_EQ(parameters(again), p) << camera.name;
  }
}

TEST(ModelParameters, StayInTheirValidRange) {
  const CameraModel unified = Unified({230, 231, 319.5, 239.5}, 0.62);
  ModelParameters p = parameters(unified);
  p(0) = -5;
  p(4) = 1.5;
  const ModelParameters bounded = parameters(with_parameters(unified, p));
  EXPECT_GT(bounded(0), 0);
  EXPECT_EQ(bounded(4), 1.0);
}

TEST(ModelParameters, JacobianMatchesFiniteDifferences) {
  Random random(3, "parameters");
  for (const Camera& camera : test_cameras()) {
    const ModelParameters p = parameters(camera.model);
    for (int trial = 0; trial < 30; ++trial) {
      const Vector3d point = visible_point(camera, random);
      const ParameterJacobian J = parameter_jacobian(camera.model, point);
      ASSERT_EQ(J.cols(), p.size());
      for (Eigen::Index k = 0; k < p.size(); ++k) {
        const double step = k < 4 ? 1e-3 : 1e-6;
        ModelParameters low = p, high = p;
        low(k) -= step;
        high(k) += step;
        const CameraModel a = with_parameters(camera.model, low), b = with_parameters(camera.model, high);
        const auto at_low = std::visit([&](const auto& m) { return m.project(point); }, a);
        const auto at_high = std::visit([&](const auto& m) { return m.project(point); }, b);
        if (!at_low || !at_high) continue;
        const Vector2d expected = (*at_high - *at_low) / (2 * step);
        EXPECT_LT((J.col(k) - expected).norm(), 1e-4 * (1 + expected.norm())) << camera.name << ", parameter " << k;
      }
    }
  }
}

TEST(ModelParameters, TypicalDeviationsArePositive) {
  for (const Camera& camera : test_cameras())
    EXPECT_GT(typical_sigmas(camera.model, 0.01, 5.0).minCoeff(), 0) << camera.name;
}

}  // namespace
}  // namespace bslam::camera
