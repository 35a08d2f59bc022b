#include "tracking/pose_between.h"

#include <gtest/gtest.h>

#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

class PoseBetween : public ::testing::Test {
 protected:
  PoseBetween() : world_(true_map(simulator(synthetic::ring_rig(1)), 1.2, 0.6)), pool_(1) {}

  std::optional<TrackResult> verify_place(frame::BundledFrame frame) {
    const BetweenKeyframes early{std::make_shared<const frame::BundledFrame>(std::move(frame)),
                                 KeyframeId(0),
                                 KeyframeId(1),
                                 world_.frames[0].frame.time_ns,
                                 world_.frames[1].frame.time_ns,
                                 world_.map.shared_rig()};
    return pose_between(world_.map, early, {0.7}, {}, pool_);
  }

  map::SimulatedMap world_;  // keyframes 0.6 s apart
  ThreadPool pool_;
};

TEST_F(PoseBetween, EqualsThePoseOfTheFrame) {
  for (const double time_s : {0.1, 0.3, 0.5}) {
    const auto seen = world_.sim.frame(FrameId(7), time_s);
    const auto result = verify_place(seen.frame);
    ASSERT_TRUE(result) << time_s;
    EXPECT_EQ(result->status, TrackStatus::kTracking);
    EXPECT_EQ(result->frame, FrameId(7));
    EXPECT_LT(map::distance_m(result->T_rig_world, seen.T_world_rig.inverse()), 0.02) << time_s;
    const geometry::SE3 by_reference = result->anchored.resolve(world_.map).value();
    EXPECT_LT(map::distance_m(by_reference, result->T_rig_world), 1e-9);
    EXPECT_GT(result->cameras[0].inliers, 30);
  }
}

TEST_F(PoseBetween, OfTheFirstKeyframeIsItsOwnPose) {
  const auto result = verify_place(world_.frames[0].frame);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->T_rig_world.matrix(), world_.map.keyframe(KeyframeId(0)).T_rig_world.matrix());
}

TEST_F(PoseBetween, WorksAfterTheSecondKeyframeWasCulled) {
  ASSERT_TRUE(world_.map.remove_keyframe(KeyframeId(1)));
  const auto seen = world_.sim.frame(FrameId(7), 0.3);
  const auto result = verify_place(seen.frame);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->anchored.reference, KeyframeId(0));
  EXPECT_LT(map::distance_m(result->T_rig_world, seen.T_world_rig.inverse()), 0.02);
}

TEST_F(PoseBetween, FailsForAFrameOfAnotherPlace) {
  EXPECT_FALSE(verify_place(simulator(synthetic::ring_rig(1), room(99)).frame(FrameId(7), 0.3).frame));
}

}  // namespace
}  // namespace bslam::tracking
