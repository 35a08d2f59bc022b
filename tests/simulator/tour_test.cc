#include "simulator/tour.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace bslam::simulator {
using synthetic::Trajectory;
namespace {

double angle_between(const geometry::SE3& a, const geometry::SE3& b) {
  return geometry::so3_log(a.rotation().inverse() * b.rotation()).norm();
}

TEST(Trajectory, DerivativesMatchDifferences) {
  const Trajectory t = make_tour(make_building(1), {});
  constexpr double kStep = 1e-5;
  for (double time = 0.37; time < 19.5; time += 0.61) {
    const Vector3d difference =
        (t.T_world_body(time + kStep).translation() - t.T_world_body(time - kStep).translation()) / (2 * kStep);
    EXPECT_NEAR((difference - t.velocity(time)).norm(), 0.0, 1e-6);
  }
}

TEST(Trajectory, IsSmoothAcrossKnots) {
  const Trajectory t = make_tour(make_building(1), {});
  for (double knot = 0.1; knot < 19.9; knot += 0.1) {
    EXPECT_NEAR((t.velocity(knot + 1e-7) - t.velocity(knot - 1e-7)).norm(), 0.0, 1e-4);
  }
}

TEST(Tour, EndsAtItsInitialPose) {
  for (const double duration : {18.0, 20.0, 45.0, 60.0}) {
    const Trajectory t = make_tour(make_building(1), {.duration_s = duration, .seed = 5});
    EXPECT_NEAR(t.duration_s(), duration, 1e-9);
    const geometry::SE3 first = t.T_world_body(0), last = t.T_world_body(duration);
    EXPECT_LT((first.translation() - last.translation()).norm(), 0.03) << duration;
    EXPECT_LT(angle_between(first, last), 0.02) << duration;
  }
}

TEST(Tour, HasTheMotionOfAPersonWalking) {
  const Trajectory t = make_tour(make_building(1), {});
  double length = 0;
  for (double time = 0; time < 20; time += 0.01) {
    const double speed = t.velocity(time).norm();
    length += 0.01 * speed;
    EXPECT_GT(speed, 0.8);
    EXPECT_LT(speed, 1.5);
    EXPECT_LT(std::abs(t.yaw_rate(time)), 60 * std::numbers::pi / 180);
    const double height = t.T_world_body(time).translation().z();
    EXPECT_GT(height, 1.2);
    EXPECT_LT(height, 1.8);
  }
  EXPECT_GT(length, 20.0);
  EXPECT_LT(length, 30.0);
}

TEST(Tour, KeepsADistanceToWallsAndFurniture) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Building building = make_building(seed);
    const Trajectory t = make_tour(building, {.duration_s = 40, .seed = seed});
    double nearest = 1e9;
    for (double time = 0; time < 40; time += 0.05) {  // steps of 6 cm: no wall fits between them at this distance
      nearest = std::min(nearest, distance_to_surfaces(building.surfaces, t.T_world_body(time).translation()));
    }
    EXPECT_GE(nearest, Building::kTourClearance) << "seed " << seed;
  }
}

TEST(Tour, ReturnsAlongTheSamePath) {
  constexpr double kDuration = 30;
  const Trajectory t = make_tour(make_building(1), {.duration_s = kDuration, .laps = 1, .back = true});
  for (double time = 0; time < 0.5 * kDuration - 2; time += 0.2) {
    const geometry::SE3 there = t.T_world_body(time), back = t.T_world_body(kDuration - time);
    EXPECT_LT((there.translation() - back.translation()).norm(), 0.01) << time;
    const double turn = angle_between(there, back);
    EXPECT_GT(turn, 160 * std::numbers::pi / 180) << time;  // roll and pitch are in the opposite direction
  }
  for (double time = 0; time < kDuration; time += 0.02) {
    EXPECT_LT(t.velocity(time).norm(), 2.5);
    EXPECT_LT(std::abs(t.yaw_rate(time)), 110 * std::numbers::pi / 180) << time;
  }
}

TEST(Tour, SwaysDifferentlyInEachLap) {
  const Trajectory t = make_tour(make_building(1), {.duration_s = 40, .laps = 2});
  double apart = 0;
  for (double time = 0; time < 20; time += 0.1) {
    apart = std::max(apart, (t.T_world_body(time).translation() - t.T_world_body(time + 20).translation()).norm());
  }
  EXPECT_GT(apart, 0.04);
}

TEST(Tour, CoversPartOfALapInAShortTime) {
  const Trajectory t = make_tour(make_building(1), {.duration_s = 3});
  for (double time = 0; time < 3; time += 0.1) EXPECT_LT(t.velocity(time).norm(), 1.5);
  EXPECT_GT((t.T_world_body(0).translation() - t.T_world_body(3).translation()).norm(), 2.5);
}

TEST(Tour, UsesSpeedAndLapsOfTheOptions) {
  const Building building = make_building(1);
  const auto length = [&](const TourOptions& options) {
    const Trajectory t = make_tour(building, options);
    double sum = 0;
    for (double time = 0; time < options.duration_s; time += 0.01) sum += 0.01 * t.velocity(time).head<2>().norm();
    return sum;
  };
  EXPECT_NEAR(length({.duration_s = 30, .speed_mps = 0.8}), 24.0, 1.2);
  EXPECT_NEAR(length({.duration_s = 60, .laps = 3}) / length({.duration_s = 20, .laps = 1}), 3.0, 0.05);
}

}  // namespace
}  // namespace bslam::simulator
