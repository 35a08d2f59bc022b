// Scale from the position of another camera on the rig.
#include "estimators/baseline_scale.h"

#include <gtest/gtest.h>

#include <vector>

#include "base/random.h"

namespace bslam::estimators {
namespace {

using Eigen::Vector3d;

constexpr double kScale = 0.37;  // metres per unit
const Vector3d kOffset(-0.11, 0.01, 0.02);

// Points at this distance, in metres, with noise of the bearings; every `wrong`th bearing is that of another point.
std::vector<BaselineObservation> observations(double distance_m, double noise_rad, int wrong = 1000) {
  Random random(3);
  const auto normal = [&] { return Vector3d(random.normal(), random.normal(), random.normal()); };
  std::vector<BaselineObservation> out;
  for (int i = 1; i <= 200; ++i) {
    const Vector3d point = distance_m * (Vector3d(0, 0, 1) + 0.3 * normal());
    const Vector3d seen = i % wrong == 0 ? Vector3d(point + 0.1 * distance_m * normal()) : Vector3d(point + kOffset);
    out.push_back({point / kScale, kOffset, (seen.normalized() + noise_rad * normal()).normalized()});
  }
  return out;
}

TEST(BaselineScale, OfExactObservations) {
  const auto found = baseline_scale(observations(3.0, 0.0));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->scale, kScale, 1e-9);
  EXPECT_EQ(found->agreeing, 200);
  EXPECT_EQ(found->deviation, 0.01);  // of the extrinsics
}

TEST(BaselineScale, DoesNotDependOnWrongMatches) {
  const auto found = baseline_scale(observations(3.0, 5e-4, /*wrong=*/3));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->scale, kScale, 0.02 * kScale);
  EXPECT_GE(found->agreeing, 130);
}

TEST(BaselineScale, CannotBeFoundFromPointsFarAway) {
  EXPECT_FALSE(baseline_scale(observations(300.0, 1e-3)));
  const auto found = baseline_scale(observations(10.0, 1e-3));
  ASSERT_TRUE(found);
  EXPECT_GT(found->deviation, 2 * baseline_scale(observations(3.0, 1e-3))->deviation);
}

TEST(BaselineScale, NeedsEnoughObservations) {
  std::vector<BaselineObservation> few = observations(3.0, 0.0);
  few.resize(14);
  EXPECT_FALSE(baseline_scale(few));
  few.clear();
  EXPECT_FALSE(baseline_scale(few));
}

}  // namespace
}  // namespace bslam::estimators
