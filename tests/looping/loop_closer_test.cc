// The loop-closing stage as a whole, keyframe by keyframe.
#include "looping/loop_closer.h"

#include <gtest/gtest.h>

#include "map/synthetic_map.h"
#include "simulated_hall.h"

namespace bslam::looping {
namespace {

using map::Fingerprint;

// Options that accept any correction as drift.
LoopingOptions options_without_drift_bound() {
  LoopingOptions options;
  options.loop.max_drift = 10;
  return options;
}

// Runs the stage on a growing map, keyframe by keyframe, until it closes a loop.
class LoopCloserRun {
 public:
  explicit LoopCloserRun(const LoopingOptions& options = {}, std::uint64_t seed = 1)
      : closer_(recogniser(), options, kFeatures, seed) {}

  // Returns true as long as no loop was closed; the draft is then unchanged.
  bool operator()(const HallMap& world, KeyframeId k) {
    map::MapDraft draft = world.draft();
    closure = closer_.close(k, draft);
    if (closure) {
      if (committed) closer_.committed(*closure);
      corrected = draft.map();
    } else {
      EXPECT_TRUE(std::move(draft).finish().edit.operations.empty());
    }
    return !closure;
  }

  bool committed = true;  // whether a closure will be committed
  std::optional<LoopClosure> closure;
  std::optional<map::BundledMap> corrected;

 private:
  LoopCloser closer_;
};

class LoopCloserRig : public ::testing::TestWithParam<int> {};

TEST_P(LoopCloserRig, ClosesTheLoopAtTheRevisitAndNotBefore) {
  LoopCloserRun run;
  const HallMap world = simulate_lap(hall(rig_of(GetParam())), 5, rigid_drift(),
                                     [&](const HallMap& w, KeyframeId k) { return run(w, k); });
  ASSERT_TRUE(run.closure);
  const KeyframeId k = run.closure->keyframe;
  EXPECT_EQ(k, world.map.newest_keyframe());
  EXPECT_GT(k.value(), kLapKeyframes - 12);
  // They are close enough to observe the same landmarks.
  EXPECT_LT(distance_m(world.truth(k), world.truth(run.closure->matched_keyframe)), 9.0);
  EXPECT_FALSE(run.closure->merged);
  const double before = distance_m(world.map.keyframe(k).T_rig_world, world.truth(k));
  EXPECT_LT(5 * distance_m(run.corrected->keyframe(k).T_rig_world, world.truth(k)), before);
  EXPECT_EQ(run.corrected->check_invariants(), std::nullopt);
}

TEST_P(LoopCloserRig, IsDeterministicForASeed) {
  const auto corrected = [&] {
    LoopCloserRun run;
    const HallMap& world = map_with_drift(GetParam());
    run(world, KeyframeId(kLapKeyframes));
    run(world, KeyframeId(kLapKeyframes + 1));
    return run.corrected;
  };
  const auto a = corrected(), b = corrected();
  ASSERT_TRUE(a && b);
  EXPECT_TRUE(Fingerprint(*a) == Fingerprint(*b));
}

INSTANTIATE_TEST_SUITE_P(Cameras, LoopCloserRig, ::testing::Values(1, 2, 4));

TEST(LoopCloser, RequiresTheConfiguredNumberOfConsecutiveKeyframes) {
  const HallMap& world = map_with_drift(2);
  LoopCloserRun run;
  EXPECT_TRUE(run(world, KeyframeId(kLapKeyframes)));
  EXPECT_FALSE(run(world, KeyframeId(kLapKeyframes + 1)));
  LoopingOptions single;
  single.loop.consistent_keyframes = 1;
  EXPECT_FALSE(LoopCloserRun(single)(world, KeyframeId(kLapKeyframes)));
}

TEST(LoopCloser, FindsALoopAgainWhoseCommitWasRejected) {
  const HallMap world = simulate_lap(hall(rig_of(2)), 3, rigid_drift());
  for (const bool committed : {true, false}) {
    LoopCloserRun run;
    run.committed = committed;
    EXPECT_TRUE(run(world, KeyframeId(kLapKeyframes)));
    EXPECT_FALSE(run(world, KeyframeId(kLapKeyframes + 1)));
    EXPECT_EQ(run(world, KeyframeId(kLapKeyframes + 2)), committed);
  }
}

TEST(LoopCloser, ClosesNothingWithoutARevisit) {
  LoopCloserRun run;
  const FeatureSimulator simulator = hall(rig_of(4));
  HallMap world(simulator.rig());
  for (int i = 0; i < 2 * kLapKeyframes / 3; ++i)
    EXPECT_TRUE(run(world, world.add(simulator.frame(FrameId(i), kStepS * i))));
}

// Two identical-looking rooms, 8 m apart: after moving from one to the other, the required correction exceeds drift.
void two_rooms(int cameras, LoopCloserRun& run) {
  const FeatureSimulator simulator = hall(rig_of(cameras));
  HallMap world(simulator.rig());
  const SE3 next_door(Eigen::Quaterniond::Identity(), {0, 8, 0});
  for (int i = 0; i < 12; ++i) {
    const int room = i / 6;
    if (!run(world, world.add(simulator.frame(FrameId(i), kStepS * (i % 6)), {}, room, room == 1 ? next_door : SE3())))
      return;
  }
}

TEST(LoopCloser, RejectsACorrectionBeyondDrift) {
  for (const int cameras : {1, 2, 4}) {
    LoopCloserRun run, unbounded(options_without_drift_bound());
    two_rooms(cameras, run);
    EXPECT_FALSE(run.closure);
    two_rooms(cameras, unbounded);
    ASSERT_TRUE(unbounded.closure);  // rejected by the drift bound only
    EXPECT_NEAR(unbounded.closure->translation_correction, 8.0, 0.05);
  }
}

// After tracking restarted in a new submap, the first keyframes that recognise an old place merge both submaps.
TEST(LoopCloser, MergesSubmapsAtACommonPlace) {
  for (const int cameras : {1, 2, 4}) {
    const FeatureSimulator simulator = hall(rig_of(cameras));
    const Sim3 elsewhere(Sim3::exp((geometry::Vector7d() << 0.1, 0.3, -1.2, 15, -7, 2, 0).finished()));
    HallMap world(simulator.rig());
    LoopCloserRun run;
    for (int i = 0; i < 10; ++i) ASSERT_TRUE(run(world, world.add(simulator.frame(FrameId(i), kStepS * i))));
    for (int i = 10; i < 13; ++i) {
      const KeyframeId k = world.add(simulator.frame(FrameId(i), kStepS * (i - 6) + 0.5), elsewhere, 0, {}, i == 10);
      if (!run(world, k)) break;
    }
    ASSERT_TRUE(run.closure);
    EXPECT_TRUE(run.closure->merged);
    EXPECT_EQ(run.corrected->roots(), std::vector{KeyframeId(0)});
    EXPECT_EQ(run.corrected->check_invariants(), std::nullopt);
    for (const KeyframeId k : run.corrected->keyframe_ids()) {
      EXPECT_LT(distance_m(run.corrected->keyframe(k).T_rig_world, world.truth(k)), 0.02);
    }
  }
}

}  // namespace
}  // namespace bslam::looping
