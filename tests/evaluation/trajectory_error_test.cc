#include "evaluation/trajectory_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/random.h"

namespace bslam::evaluation {
namespace {

using geometry::Quaterniond;
using geometry::SE3;
using geometry::Sim3;
using geometry::Vector3d;

constexpr TimeNs kFrame = 50'000'000;  // 20 Hz

// A winding path with changing orientation.
Trajectory winding(std::size_t count, TimeNs interval_ns = kFrame, TimeNs start_ns = 1'403'636'579'763'555'584) {
  Trajectory trajectory;
  for (std::size_t i = 0; i < count; ++i) {
    const TimeNs offset = static_cast<TimeNs>(i) * interval_ns;
    const double t = to_seconds(offset);
    trajectory.push_back({start_ns + offset, SE3(geometry::so3_exp(Vector3d(0.2 * std::sin(t), 0.1 * t, 0.5 * t)),
                                                 Vector3d(4 * std::cos(0.3 * t), 3 * std::sin(0.5 * t), std::sin(t)))});
  }
  return trajectory;
}

Trajectory moved_by(const Trajectory& trajectory, const Sim3& similarity) {
  Trajectory moved = trajectory;
  for (TimedPose& pose : moved) pose.T_world_frame = similarity.apply_to_pose(pose.T_world_frame);
  return moved;
}

TimedPose still(TimeNs time_ns, double x, double y, double z) {
  return {time_ns, SE3(Quaterniond::Identity(), Vector3d(x, y, z))};
}

TEST(TrajectoryError, IsZeroAfterAlignmentOfAMovedCopy) {
  const Trajectory truth = winding(200);
  const Sim3 rigid(1.0, geometry::so3_exp(Vector3d(0.5, -1.0, 2.0)), Vector3d(10, -20, 3));
  const auto result = evaluate(moved_by(truth, rigid), truth, {});
  ASSERT_TRUE(result.ok());
  EXPECT_LT(result->ate.max, 1e-9);
  EXPECT_LT(result->rpe.translation_m.max, 1e-9);
  EXPECT_LT(result->rpe.rotation_deg.max, 1e-5);  // an angle near zero has half of the digits
  EXPECT_EQ(result->ate.count, 200u);
  EXPECT_EQ(result->rpe.translation_m.count, 180u);
  EXPECT_DOUBLE_EQ(result->coverage, 1.0);
  ASSERT_TRUE(result->scale.has_value());
  EXPECT_NEAR(*result->scale, 1.0, 1e-9);
  EXPECT_NEAR(result->gt_length_m, path_length_m(truth), 1e-12);
}

TEST(TrajectoryError, ReportsTheFittedScaleForAnyAlignment) {
  const Trajectory truth = winding(200);
  const Trajectory estimate =
      moved_by(truth, Sim3(0.25, geometry::so3_exp(Vector3d(0.5, -1.0, 2.0)), Vector3d(1, 2, 3)));
  for (const AlignMode mode : {AlignMode::kNone, AlignMode::kSe3, AlignMode::kSim3}) {
    const auto result = evaluate(estimate, truth, {.align = mode});
    ASSERT_TRUE(result.ok());
    EXPECT_NEAR(*result->scale, 4.0, 1e-9);
    if (mode == AlignMode::kSim3) {
      EXPECT_LT(result->ate.max, 1e-9);
      EXPECT_LT(result->rpe.translation_m.max, 1e-9);  // measured on the scaled poses
    } else {
      EXPECT_GT(result->ate.rmse, 0.5);
    }
  }
}

TEST(TrajectoryError, AgreesWithStatisticsComputedByHand) {
  const Trajectory truth = {still(0, 0, 0, 0), still(kFrame, 1, 0, 0), still(2 * kFrame, 1, 1, 0),
                            still(3 * kFrame, 1, 1, 1)};
  Trajectory estimate = truth;
  const double errors[] = {0.1, 0.4, 0.2, 0.3};
  for (std::size_t i = 0; i < 4; ++i) {
    const SE3& T = truth[i].T_world_frame;
    estimate[i].T_world_frame = SE3(T.rotation(), T.translation() + Vector3d(0, 0, errors[i]));
  }
  const auto result = evaluate(estimate, truth, {.align = AlignMode::kNone});
  ASSERT_TRUE(result.ok());
  EXPECT_NEAR(result->ate.rmse, std::sqrt(0.30 / 4), 1e-15);
  EXPECT_NEAR(result->ate.mean, 0.25, 1e-15);
  EXPECT_NEAR(result->ate.median, 0.25, 1e-15);
  EXPECT_NEAR(result->ate.max, 0.4, 1e-15);
  EXPECT_EQ(result->ate.count, 4u);
  EXPECT_DOUBLE_EQ(result->gt_length_m, 3.0);
  EXPECT_EQ(result->rpe.translation_m.count, 0u);  // no two poses are one second apart
  EXPECT_TRUE(std::isnan(result->rpe.translation_m.rmse));
}

TEST(RelativeError, MeasuresDriftOverDeltaByHand) {
  // In each frame the estimate rotates 1 degree too much about z and climbs 2 cm too much: over 4 frames 4 degrees and
  // 8 cm.
  Trajectory truth, estimate;
  const SE3 step(Quaterniond::Identity(), Vector3d(0, 0, 0.1));
  const SE3 wrong(geometry::so3_exp(Vector3d(0, 0, std::numbers::pi / 180.0)), Vector3d(0, 0, 0.12));
  SE3 T_truth, T_estimate;
  for (int i = 0; i < 20; ++i) {
    truth.push_back({i * kFrame, T_truth});
    estimate.push_back({i * kFrame, T_estimate});
    T_truth = T_truth * step;
    T_estimate = T_estimate * wrong;
  }
  const auto result = evaluate(estimate, truth, {.align = AlignMode::kNone, .rpe_delta_s = 0.2});
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->rpe.translation_m.count, 16u);
  EXPECT_NEAR(result->rpe.translation_m.rmse, 0.08, 1e-12);
  EXPECT_NEAR(result->rpe.rotation_deg.rmse, 4.0, 1e-10);
  EXPECT_NEAR(*result->scale, 0.1 / 0.12, 1e-12);
}

TEST(RelativeError, MakesNoPairWithAMissingFrame) {
  const Trajectory truth = winding(100);
  Trajectory estimate = truth;
  estimate.erase(estimate.begin() + 40, estimate.begin() + 50);
  const auto result = evaluate(estimate, truth, {.align = AlignMode::kNone});
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->rpe.translation_m.count, 80u - 20u);  // ten pairs lack their first pose, ten their second
}

TEST(RelativeError, ToleratesJitterOfTheFrameTimes) {
  Trajectory truth = winding(100), estimate = truth;
  Random random(3, "times");
  for (TimedPose& pose : estimate) pose.time_ns += static_cast<TimeNs>(random.uniform(-5e6, 5e6));
  const auto result = evaluate(estimate, truth, {});
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->rpe.translation_m.count, 80u);
  EXPECT_LT(result->rpe.translation_m.max, 1e-9);
}

TEST(Coverage, IsTheFractionOfGroundTruthFramesWithAPose) {
  const Trajectory truth = winding(200);
  Trajectory estimate = truth;
  estimate.erase(estimate.begin() + 60, estimate.begin() + 80);
  estimate.erase(estimate.begin(), estimate.begin() + 10);
  const auto result = evaluate(estimate, truth, {});
  ASSERT_TRUE(result.ok());
  EXPECT_DOUBLE_EQ(result->coverage, 170.0 / 200.0);
}

TEST(Coverage, CountsFramesWithDenserGroundTruth) {
  // Ground truth at 200 Hz for frames 20 .. 179 except 100 .. 109; poses for frames 30 .. 199 except 60 .. 69 and 104
  // .. 111.
  const Trajectory dense = winding(2000, kFrame / 10);
  Trajectory truth, estimate;
  for (std::size_t i = 0; i < dense.size(); ++i) {
    const std::size_t frame = i / 10;
    if (frame < 20 || frame > 179 || (frame >= 100 && frame <= 109)) continue;
    truth.push_back(dense[i]);
  }
  const Trajectory frames = winding(200);
  for (std::size_t k = 30; k < 200; ++k) {
    if ((k >= 60 && k <= 69) || (k >= 104 && k <= 111)) continue;
    estimate.push_back(frames[k]);
  }
  const auto result = evaluate(estimate, truth, {.max_dt_ns = 2'000'000});
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->ate.count, 150u - 10u - 10u - 2u);  // without 20-29, 60-69, 110, 111
  EXPECT_DOUBLE_EQ(result->coverage, 128.0 / 150.0);
}

TEST(Coverage, OfThePartThatWasRunCountsLossesWithinItOnly) {
  const Trajectory frames = winding(200);
  for (const Trajectory& truth : {frames, winding(2000, kFrame / 10)}) {
    Trajectory part(frames.begin() + 40, frames.begin() + 80);
    auto result = evaluate(part, truth, {});
    ASSERT_TRUE(result.ok());
    EXPECT_LT(result->coverage, 0.21);
    EXPECT_DOUBLE_EQ(result->coverage_of_part, 1.0);
    result = evaluate(part, truth, {.max_dt_ns = 2 * kFrame});
    ASSERT_TRUE(result.ok());
    EXPECT_DOUBLE_EQ(result->coverage_of_part, 1.0);
    part.erase(part.begin() + 10, part.begin() + 20);
    result = evaluate(part, truth, {});
    ASSERT_TRUE(result.ok());
    EXPECT_DOUBLE_EQ(result->coverage_of_part, 30.0 / 40.0);
  }
}

// As EuRoC ground truth of a simulated recording, which ends an interval after the last image.
TEST(Coverage, IsCompleteIfGroundTruthBeginsAndEndsWithinAnIntervalOfTheImages) {
  const Trajectory dense = winding(1991, kFrame / 10), frames = winding(200);  // both end with frame 199
  const auto coverage_of = [&](std::size_t from, std::size_t to) {
    const auto result = evaluate(Trajectory(frames.begin() + from, frames.begin() + to), dense, {});
    return result ? result->coverage : 0.0;
  };
  EXPECT_DOUBLE_EQ(coverage_of(1, 199), 1.0);
  EXPECT_DOUBLE_EQ(coverage_of(2, 199), 197.0 / 199.0) << "frames 0 and 1";
  EXPECT_DOUBLE_EQ(coverage_of(1, 197), 196.0 / 199.0) << "frames 197, 198 and 199";
}

TEST(Coverage, IsFastWithAStrayTimestampFarAway) {
  Trajectory truth = winding(2000, kFrame / 10);
  truth.insert(truth.begin(), still(0, 0, 0, 0));  // half a century before the rest
  const auto result = evaluate(winding(200), truth, {});
  ASSERT_TRUE(result.ok());
  EXPECT_NEAR(result->coverage, 1.0, 1e-12);
}

TEST(TrajectoryError, RejectsFewerThanThreePairs) {
  Trajectory truth = winding(10), estimate(truth.begin(), truth.begin() + 2);
  const auto result = evaluate(estimate, truth, {});
  ASSERT_FALSE(result.ok());
  const std::string text = result.error().message();
  EXPECT_EQ(text.find("found 2 poses within 0.01 s of a ground-truth pose, expected at least 3; the estimate is from "),
            0u)
      << text;
  EXPECT_NE(text.find(", the ground truth from "), std::string::npos) << text;
  EXPECT_FALSE(evaluate({}, truth, {}).ok());
  EXPECT_FALSE(evaluate(truth, {}, {}).ok());
}

// Ground truth exactly on a line, as in simulated worlds, and an estimate with noise in all directions.
TEST(TrajectoryError, AlignsToAStraightLine) {
  const Vector3d direction = Vector3d(1, 2, -1).normalized();
  Trajectory truth, estimate;
  Random random(4, "line");
  double sideways = 0.0;
  for (int i = 0; i < 50; ++i) {
    const Vector3d noise = 0.01 * direction.cross(Vector3d(random.normal(), random.normal(), random.normal()));
    truth.push_back({i * kFrame, SE3(Quaterniond::Identity(), 0.1 * i * direction)});
    estimate.push_back({i * kFrame, SE3(Quaterniond::Identity(), 0.1 * i * direction + noise)});
    sideways += noise.squaredNorm();
  }
  const Sim3 similarity(0.5, geometry::so3_exp(Vector3d(0.5, -1.0, 2.0)), Vector3d(1, 2, 3));
  const auto result = evaluate(moved_by(estimate, similarity), truth, {.align = AlignMode::kSim3});
  ASSERT_TRUE(result.ok());
  EXPECT_NEAR(*result->scale, 2.0, 0.01);
  EXPECT_GT(result->ate.rmse, 0.0);
  // the best alignment is at least as good as the true one
  EXPECT_LE(result->ate.rmse, std::sqrt(sideways / 50) + 1e-12);
  const auto exact = evaluate(truth, truth, {});
  ASSERT_TRUE(exact.ok());
  EXPECT_LT(exact->ate.max, 1e-12);
  EXPECT_NEAR(*exact->scale, 1.0, 1e-12);
}

TEST(TrajectoryError, AlignsMotionlessTrajectoriesOnlyWithoutScale) {
  Trajectory truth, estimate;
  for (int i = 0; i < 4; ++i) {
    truth.push_back(still(i * kFrame, 1, 2, 3));
    estimate.push_back(still(i * kFrame, 0.1 * (i % 2), 0, 0));
  }
  const auto result = evaluate(estimate, truth, {});
  ASSERT_TRUE(result.ok());
  EXPECT_NEAR(result->ate.rmse, 0.05, 1e-12);
  EXPECT_FALSE(result->scale.has_value());
  const auto scaled = evaluate(estimate, truth, {.align = AlignMode::kSim3});
  ASSERT_FALSE(scaled.ok());
  EXPECT_NE(scaled.error().message(), "");
}

}  // namespace
}  // namespace bslam::evaluation
