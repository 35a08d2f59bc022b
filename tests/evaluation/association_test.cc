#include "evaluation/association.h"

#include <gtest/gtest.h>

namespace bslam::evaluation {
namespace {

using geometry::Quaterniond;
using geometry::SE3;
using geometry::Vector3d;

constexpr TimeNs kMs = 1'000'000;

Trajectory at_ms(std::initializer_list<TimeNs> times_ms) {
  Trajectory trajectory;
  for (const TimeNs t : times_ms) {
    trajectory.push_back({t * kMs, SE3(Quaterniond::Identity(), Vector3d(static_cast<double>(t), 0, 0))});
  }
  return trajectory;
}

std::vector<std::pair<std::size_t, std::size_t>> pairs_of(const Trajectory& estimate, const Trajectory& truth,
                                                          TimeNs max_dt_ms) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const Association& a : associate(estimate, truth, max_dt_ms * kMs))
    pairs.emplace_back(a.estimate, a.ground_truth);
  return pairs;
}

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

TEST(Association, SelectsTheNearestPoseOfADenserGroundTruth) {
  EXPECT_EQ(pairs_of(at_ms({0, 50, 100}), at_ms({2, 48, 49, 53, 90, 99, 104}), 10), (Pairs{{0, 0}, {1, 2}, {2, 5}}));
}

TEST(Association, SelectsTheNearestPoseOfADenserEstimate) {
  EXPECT_EQ(pairs_of(at_ms({0, 10, 20, 30, 40}), at_ms({11, 39}), 10), (Pairs{{1, 0}, {4, 1}}));
}

TEST(Association, IgnoresPosesTooFarApart) {
  EXPECT_EQ(pairs_of(at_ms({0, 50, 100}), at_ms({10, 61, 100}), 10), (Pairs{{0, 0}, {2, 2}}));
  EXPECT_TRUE(pairs_of(at_ms({0}), at_ms({11}), 10).empty());
  EXPECT_TRUE(pairs_of({}, at_ms({11}), 10).empty());
}

TEST(Association, UsesEachEstimateOnceForTheNearestTruth) {
  EXPECT_EQ(pairs_of(at_ms({0, 100, 200, 300}), at_ms({92, 99, 104}), 10), (Pairs{{1, 1}}));
}

TEST(Association, SelectsTheEarlierPoseOnTies) {
  EXPECT_EQ(nearest_in_time(at_ms({0, 10}), 5 * kMs), 0u);
  EXPECT_EQ(nearest_in_time(at_ms({0, 10}), 6 * kMs), 1u);
  EXPECT_EQ(nearest_in_time(at_ms({0, 10}), -99 * kMs), 0u);
  EXPECT_EQ(nearest_in_time(at_ms({0, 10}), 99 * kMs), 1u);
}

TEST(Trajectory, HasLengthAndMedianInterval) {
  EXPECT_DOUBLE_EQ(path_length_m(at_ms({0, 3, 7})), 7.0);
  EXPECT_EQ(median_interval_ns(at_ms({0, 10, 20, 30, 500})), 10 * kMs);
  EXPECT_EQ(median_interval_ns(at_ms({5})), 0);
}

TEST(Trajectory, ConvertsToAnotherFrameOnTheSameBody) {
  const SE3 T_world_cam(geometry::so3_exp(Vector3d(0.1, -0.4, 0.9)), Vector3d(1, 2, 3));
  const SE3 T_body_cam(geometry::so3_exp(Vector3d(1.2, 0.3, -0.2)), Vector3d(0.1, -0.2, 0.05));
  const Trajectory body = moved_to_frame({{7, T_world_cam}}, T_body_cam.inverse());
  ASSERT_EQ(body.size(), 1u);
  EXPECT_EQ(body[0].time_ns, 7);
  // The camera pose computed from the body pose is unchanged.
  EXPECT_LT(((body[0].T_world_frame * T_body_cam).matrix() - T_world_cam.matrix()).norm(), 1e-12);
}

// Both paths are then of one frame, whose distance from the camera is known in metres only.
TEST(Trajectory, IsMovedToOneFrameWithTheGroundTruth) {
  const SE3 T_world_cam(geometry::so3_exp(Vector3d(0.1, -0.4, 0.9)), Vector3d(1, 2, 3));
  const SE3 T_cam_body(geometry::so3_exp(Vector3d(1.2, 0.3, -0.2)), Vector3d(0.3, 0, 0.4));
  for (const bool metric : {true, false}) {
    Trajectory estimate = {{7, T_world_cam}}, truth = {{7, T_world_cam * T_cam_body}};
    EXPECT_DOUBLE_EQ(move_to_one_frame(T_cam_body, metric, estimate, truth), metric ? 0 : 0.5);
    EXPECT_LT((estimate[0].T_world_frame.matrix() - truth[0].T_world_frame.matrix()).norm(), 1e-12);
    EXPECT_EQ(estimate[0].T_world_frame.matrix() == T_world_cam.matrix(), !metric);
  }
}

}  // namespace
}  // namespace bslam::evaluation
