#include "looping/joined_return.h"

#include <gtest/gtest.h>

#include "looping/loop_closer.h"
#include "simulated_hall.h"

namespace bslam::looping {
namespace {

constexpr int kAfter = 5;  // keyframes after a lap

// A lap of which the end observes the landmarks of the beginning again, as if tracking had found them.
class JoinedReturn : public ::testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < kLapKeyframes + kAfter; ++i) {
      hall_map.add(simulator.frame(FrameId(i), kStepS * i));
      if (const auto found = returns.find(hall_map.map, hall_map.map.newest_keyframe(), {})) {
        EXPECT_LT(distance_m(hall_map.truth(*found), hall_map.truth(hall_map.map.newest_keyframe())), 1.0);
        at.push_back(i);
      }
    }
  }

  FeatureSimulator simulator = hall(rig_of(2));
  HallMap hall_map{simulator.rig(), 1000};
  JoinedReturns returns;
  std::vector<int> at;
};

TEST_F(JoinedReturn, IsFoundWhereTheRigIsBackAtTheFirstKeyframes) {
  ASSERT_FALSE(at.empty());
  EXPECT_GT(at.front(), kLapKeyframes - 3);
  EXPECT_EQ(at.back(), kLapKeyframes + kAfter - 1);  // it has not been closed
}

TEST_F(JoinedReturn, IsNotReportedAgainWhileItGoesOn) {
  returns.closed(KeyframeId(at.front()));
  for (int i = at.front() + 1; i < kLapKeyframes + kAfter; ++i)
    EXPECT_FALSE(returns.find(hall_map.map, KeyframeId(i), {})) << i;
}

TEST_F(JoinedReturn, IsClosedAsALoop) {
  LoopCloser closer(recogniser(), {}, kFeatures, 1);
  std::vector<LoopClosure> closed;
  for (int i = 0; i < kLapKeyframes + kAfter; ++i) {
    map::MapDraft draft = hall_map.draft();
    const auto loop = closer.close(KeyframeId(i), draft);
    if (!loop) continue;
    closed.push_back(*loop);
    closer.committed(*loop);
  }
  ASSERT_EQ(closed.size(), 1u);
  EXPECT_GE(closed.front().keyframe.value(), at.front());
  EXPECT_LT(closed.front().translation_correction, 0.05);
}

// Distant landmarks of the hall are observed all along, so that no keyframe is ever without covisible ones.
TEST(JoinedReturnInAWideRoom, IsFoundAlthoughSomeOfThePlaceIsAlwaysInSight) {
  synthetic::FeatureSimulatorOptions options = hall_options();
  options.landmarks = 6000;
  options.farthest_base = 12;
  const FeatureSimulator simulator(rig_of(4), laps(), options);
  HallMap hall_map{simulator.rig(), 1000};
  JoinedReturns returns;
  std::vector<int> at;
  for (int i = 0; i < kLapKeyframes + kAfter; ++i) {
    hall_map.add(simulator.frame(FrameId(i), kStepS * i));
    if (returns.find(hall_map.map, hall_map.map.newest_keyframe(), {})) at.push_back(i);
  }
  EXPECT_EQ(neighbours_of(hall_map.map, KeyframeId(0), {}).size(), hall_map.map.num_keyframes() - 1);
  ASSERT_FALSE(at.empty());
  EXPECT_GT(at.front(), kLapKeyframes - 3);
}

}  // namespace
}  // namespace bslam::looping
