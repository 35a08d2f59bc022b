// Loop closures, and merging of submaps at a place observed in both.
#include <gtest/gtest.h>

#include <thread>

#include "system/closed_walk.h"

namespace bslam::system {
namespace {

// A loop between the last and the first frames of the trajectory.
void expect_loop(const System& system) {
  const auto& frames = closed_walk().frames();
  ASSERT_FALSE(system.loops().empty());
  const LoopRecord loop = system.loops().front();
  EXPECT_GE(loop.time_ns, frames[kRound - 12].time_ns);
  EXPECT_LE(loop.with_time_ns, frames[12].time_ns);
  EXPECT_FALSE(loop.closure.merged);
  EXPECT_GE(loop.closure.inliers, 50);
  EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt);
}

TEST(SystemLoopSequential, ClosesTheLoopAndRemovesTheError) {
  Config config = small_config(execution::Mode::kSequential);
  config.final_adjustment = false;
  config.tracking.frontend = tracking::FrontEnd::kFeatures;  // more keyframes and more drift
  Config off = config;
  off.looping.loop.enabled = false;
  System system(closed_walk().rig(), config, with_vocabulary());
  System open(closed_walk().rig(), off, with_vocabulary());
  System blind(closed_walk().rig(), config);
  for (System* s : {&system, &open, &blind}) {
    process_all(*s, closed_walk().frames());
    s->finish();
    EXPECT_EQ(tracked_frames(*s), kWalk);
    EXPECT_EQ(s->trajectories().size(), 1u);
    expect_smooth(*s, closed_walk().truth());
  }
  expect_loop(system);
  EXPECT_TRUE(open.loops().empty());
  EXPECT_TRUE(blind.loops().empty());
  EXPECT_TRUE(identical(open.trajectories(), blind.trajectories()));
  EXPECT_LT(1.5 * ate_m(final_poses(system), closed_walk().truth()), ate_m(final_poses(open), closed_walk().truth()));
  const map::BundledMap &closed_map = *system.snapshot(), &open_map = *open.snapshot();
  EXPECT_LT(closed_map.num_landmarks(), open_map.num_landmarks());  // duplicate landmarks are fused
}

// After dark frames the rig initialises a second submap, which is merged when it returns to the first place.
class SystemLoopSubmaps : public ::testing::Test {
 protected:
  static constexpr std::size_t kFirst = 16, kAfter = 3;  // frames of the first submap; lost frames before the second
  static Playback carried() { return play(closed_walk(), {{0, kFirst}, {36, kWalk}}); }
  static Config config() {
    Config out = small_config(execution::Mode::kSequential);
    out.looping.recovery.new_submap_after = static_cast<int>(kAfter);
    return out;
  }
};

TEST_F(SystemLoopSubmaps, ASubmapIsMergedAtAKnownPlace) {
  const Playback walk = carried();
  System system(closed_walk().rig(), config(), with_vocabulary());
  std::size_t two = 0;
  for (std::size_t k = 0; k < walk.frames.size(); ++k) {
    const FrameRecord record = must_process(system, walk.frames[k]);
    const bool lost = k >= kFirst && k < kFirst + kAfter - 1;
    EXPECT_EQ(is_tracked(record), !lost) << "frame " << k;
    const std::vector<SubmapTrajectory> submaps = system.trajectories();
    two += submaps.size() == 2;
    EXPECT_EQ(submaps.size(), system.loops().empty() && k >= kFirst + kAfter - 1 ? 2u : 1u) << "frame " << k;
    EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt) << "frame " << k;
  }
  EXPECT_GT(two, 10u);
  system.finish();
  EXPECT_EQ(system.maps_started(), 2);
  ASSERT_EQ(system.loops().size(), 1u);
  EXPECT_TRUE(system.loops().front().closure.merged);
  ASSERT_EQ(system.trajectories().size(), 1u);
  EXPECT_EQ(final_poses(system).size(), walk.frames.size() - (kAfter - 1));
  EXPECT_LT(ate_m(final_poses(system), walk.truth), 0.01);
  EXPECT_EQ(system.live_trajectories().size(), 2u);  // uncorrected
}

TEST_F(SystemLoopSubmaps, TheOdometryPoseIsContinuousWhenTheMapIsCorrected) {
  const Playback walk = carried();
  System system(closed_walk().rig(), config(), with_vocabulary());
  process_all(system, walk.frames);
  system.finish();
  expect_smooth(system, walk.truth);
  const std::vector<FrameRecord>& frames = system.frames();
  for (std::size_t k = kFirst; k < kFirst + kAfter; ++k) {  // the motion is unknown
    EXPECT_EQ(frames[k].T_rig_odom.translation(), frames[kFirst - 1].T_rig_odom.translation()) << "frame " << k;
  }
  double jump = 0;
  for (std::size_t k = kFirst + kAfter; k < frames.size(); ++k) {
    jump = std::max(jump, (frames[k].T_map_odom * frames[k - 1].T_map_odom.inverse()).translation().norm());
  }
  EXPECT_GT(jump, 0.2);  // metres, from the world frame of one submap to that of the other
}

TEST(SystemLoopParallel, ClosesTheLoopDuringTheRun) {
  System system(closed_walk().rig(), small_config(execution::Mode::kParallel), with_vocabulary());
  process_all(system, closed_walk().frames());
  system.finish();
  EXPECT_EQ(tracked_frames(system), kWalk);
  expect_loop(system);
  expect_smooth(system, closed_walk().truth());
  EXPECT_EQ(system.trajectories().size(), 1u);
  EXPECT_LT(ate_m(final_poses(system), closed_walk().truth()), 0.005);
}

TEST(SystemLoopLagged, MapDoesNotDependOnTheNumberOfThreads) {
  std::vector<SubmapTrajectory> final, live;
  map::MapSnapshot map;
  for (const int threads : {1, 2, 4}) {
    System system(closed_walk().rig(), small_config(execution::Mode::kLagged, threads), with_vocabulary());
    process_all(system, closed_walk().frames());
    system.finish();
    expect_loop(system);
    if (!map) {
      map = system.snapshot();
      final = system.trajectories();
      live = system.live_trajectories();
      EXPECT_EQ(final_poses(system).size(), kWalk);
    }
    EXPECT_TRUE(identical(*map, *system.snapshot())) << threads << " threads";
    EXPECT_TRUE(identical(final, system.trajectories())) << threads << " threads";
    EXPECT_TRUE(identical(live, system.live_trajectories())) << threads << " threads";
  }
}

TEST(SystemLoopReplay, RepeatsAParallelRunWithLoopsExactly) {
  const Playback walk = play(closed_walk(), {{0, 16}, {36, kWalk}});  // merged, then closed
  Config config = small_config(execution::Mode::kParallel);
  config.looping.recovery.new_submap_after = 3;
  for (int i = 0; i < 2; ++i) {
    System recorded(closed_walk().rig(), config, with_vocabulary());
    process_all(recorded, walk.frames);
    recorded.finish();
    EXPECT_FALSE(recorded.loops().empty());
    auto journal = execution::parse_journal(execution::journal_text(recorded.journal()), "recorded");
    ASSERT_TRUE(journal.ok());
    Resources resources = with_vocabulary();
    resources.replay = std::move(*journal);
    System replayed(closed_walk().rig(), config, std::move(resources));
    process_all(replayed, walk.frames);
    replayed.finish();
    EXPECT_TRUE(identical(*recorded.snapshot(), *replayed.snapshot()));
    EXPECT_TRUE(identical(recorded.trajectories(), replayed.trajectories()));
    EXPECT_TRUE(identical(recorded.live_trajectories(), replayed.live_trajectories()));
    EXPECT_EQ(recorded.loops().size(), replayed.loops().size());
  }
}

// The runs continue in the map of the trajectory until shortly before its end, so that the loop follows soon.
class SystemLoopEnd : public ::testing::TestWithParam<execution::Mode> {};

TEST_P(SystemLoopEnd, RunsCanEndAtAnyFrameParallel) {
  const Playback end = play(closed_walk(), {{48, 66}});
  Config before = small_config(execution::Mode::kSequential);
  before.final_adjustment = false;
  before.tracking.frontend = tracking::FrontEnd::kFeatures;  // more keyframes, so that the loop is found in many runs
  System open(closed_walk().rig(), before, with_vocabulary());
  process_all(open, play(closed_walk(), {{0, 52}}).frames);
  ASSERT_TRUE(open.loops().empty());
  Config config = small_config(GetParam());
  config.tracking.frontend = tracking::FrontEnd::kFeatures;
  config.execution.lag_map = config.execution.lag_loop = 1;
  config.execution.lag_global = 3;
  Random random(7, "early end");
  std::size_t closed = 0;
  constexpr std::size_t kRuns = 25;
  for (std::size_t i = 0; i < kRuns; ++i) {
    Resources resources = with_vocabulary();
    resources.map = *open.snapshot();
    System system(closed_walk().rig(), config, std::move(resources));
    const std::size_t frames = random.below(static_cast<std::uint32_t>(end.frames.size() + 1));
    std::jthread interruption;
    for (std::size_t k = 0; k < frames; ++k) {
      if (i % 3 != 0 && k + 1 == frames) interruption = std::jthread([&] { system.interrupt(); });
      must_process(system, end.frames[k]);
    }
    closed += !system.loops().empty();
    if (i % 3 != 2) continue;  // destroyed without finish()
    system.interrupt();
    system.finish();
    EXPECT_EQ(system.frames().size(), frames);
    EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt);
  }
  EXPECT_LT(closed, kRuns);
  if (GetParam() == execution::Mode::kLagged) {  // ends before and after the loop, independent of timing
    EXPECT_GT(closed, 3u);
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, SystemLoopEnd, ::testing::Values(execution::Mode::kParallel, execution::Mode::kLagged));

}  // namespace
}  // namespace bslam::system
