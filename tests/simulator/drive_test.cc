#include "simulator/drive.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "simulator/route.h"

namespace bslam::simulator {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

Drive drive_of(double length, double speed, std::uint64_t seed) {
  return make_drive(make_route(make_street_grid(seed), length, seed), speed, seed);
}

TEST(Drive, EndsAtItsInitialPose) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Drive drive = drive_of(1200, kTownSpeed, seed);
    const geometry::SE3 first = drive.trajectory.T_world_body(0),
                        last = drive.trajectory.T_world_body(drive.trajectory.duration_s());
    EXPECT_LT((first.translation() - last.translation()).norm(), 0.02);
    EXPECT_LT(geometry::so3_log(first.rotation().inverse() * last.rotation()).norm(), 0.01);
  }
}

TEST(Drive, SlowsDownInCurves) {
  for (const double speed : {kTownSpeed, 20.0}) {
    const synthetic::Trajectory t = drive_of(1500, speed, 2).trajectory;
    double fastest = 0, slowest = 1e9, sharpest = 0;
    for (double time = 0; time < t.duration_s(); time += 0.02) {
      fastest = std::max(fastest, t.velocity(time).norm());
      slowest = std::min(slowest, t.velocity(time).norm());
      sharpest = std::max(sharpest, std::abs(t.yaw_rate(time)));
    }
    EXPECT_LT(fastest, speed + 0.2);
    EXPECT_GT(fastest, std::min(speed, 10.0) - 0.2);
    EXPECT_GT(slowest, 3.0);
    EXPECT_LT(sharpest, 45 * kDegree);
    EXPECT_GT(sharpest, 25 * kDegree);
  }
}

TEST(Drive, SwaysLikeAVehicle) {
  const synthetic::Trajectory t = drive_of(1500, kTownSpeed, 1).trajectory;
  double tilt = 0;
  for (double time = 0; time < t.duration_s(); time += 0.05) {
    const geometry::SE3 pose = t.T_world_body(time);
    EXPECT_NEAR(pose.translation().z(), kCameraHeight, 0.05);
    tilt = std::max(tilt, std::acos(std::min(1.0, pose.matrix3()(2, 2))));
  }
  EXPECT_GT(tilt, 0.3 * kDegree);
  EXPECT_LT(tilt, 1.5 * kDegree);
}

TEST(Drive, IsDividedIntoSectionsOfAboutTheSameLength) {
  const Drive drive = drive_of(2000, kTownSpeed, 1);
  EXPECT_EQ(drive.section_ends.size(), 20u);
  EXPECT_EQ(drive.section_ends.back(), drive.trajectory.duration_s());
  double from = 0;
  for (const double end : drive.section_ends) {
    double length = 0;
    for (double time = from; time < end; time += 0.05) length += 0.05 * drive.trajectory.velocity(time).norm();
    EXPECT_NEAR(length, Drive::kSectionLength, 3.0);
    from = end;
  }
}

TEST(Drive, LastsAsLongAsItsLengthAtTheSpeed) {
  EXPECT_NEAR(drive_of(5000, kTownSpeed, 1).trajectory.duration_s(), 5000 / 7.6, 30);
  EXPECT_LT(drive_of(5000, 15, 1).trajectory.duration_s(), 520);
}

}  // namespace
}  // namespace bslam::simulator
