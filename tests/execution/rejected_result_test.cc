// A result that corrects the map is rejected if another correction was committed since its base. Its task is run again.
#include <gtest/gtest.h>

#include <algorithm>
#include <latch>

#include "execution/stage_world.h"

namespace bslam::execution {
namespace {

map::MapDraft scaled(const map::MapSnapshot& base, double factor) {
  map::MapDraft draft(base);
  EXPECT_TRUE(draft.scale_submap(KeyframeId(0), factor));
  return draft;
}

// kMap scales the map by 2. It waits for `corrected` before it returns its first result.
StageFunctions scaling_stage(std::latch& corrected) {
  StageFunctions functions;
  functions[Stage::kMap] = [&corrected](const StageTask&, const map::MapSnapshot& base, const std::stop_token&) {
    corrected.wait();
    return StageResult{scaled(base, 2.0), {}};
  };
  return functions;
}

// The caller commits another correction, by a factor of 3, while kMap runs.
Journal run(StageExecutor& executor, MapGate& gate, std::latch& corrected) {
  const StageWorld world;
  executor.enqueue(world.add_keyframe(FrameId(0), executor.begin_frame(FrameId(0), 0), executor));
  executor.commit(JournalStep::kTrack, scaled(executor.begin_frame(FrameId(1), 0), 3.0));
  corrected.count_down();
  for (int i = 2; i < 20; ++i) executor.begin_frame(FrameId(i), 0);
  executor.drain();
  executor.end();
  EXPECT_DOUBLE_EQ(gate.newest()->keyframe(KeyframeId(0)).scale, 6.0);
  return gate.journal();
}

TEST(RejectedResult, ItsTaskIsRunAgainOnTheNewestVersion) {
  for (const Mode mode : {Mode::kParallel, Mode::kLagged}) {
    Journal journal;
    {
      std::latch corrected(1);
      map::MapStore store{StageWorld().empty_map()};
      MapGate gate(store);
      ExecutionSetup setup{scaling_stage(corrected), {}, {}};
      setup.options.await_calibration = false;
      const auto executor = make_stage_executor(mode, gate, std::move(setup));
      journal = run(*executor, gate, corrected);
    }
    std::vector<bool> committed;
    for (const JournalEntry& e : journal.entries) {
      if (e.step == JournalStep::kMap) committed.push_back(e.committed.has_value());
    }
    if (mode == Mode::kLagged) {
      EXPECT_EQ(committed, (std::vector<bool>{false, true}));
    }
    ASSERT_FALSE(committed.empty());  // in parallel mode, the task may begin after the correction
    EXPECT_TRUE(committed.back());
    EXPECT_EQ(std::ranges::count(committed, true), 1);

    std::latch open(0);
    map::MapStore store{StageWorld().empty_map()};
    MapGate gate(store);
    const auto replay = make_replay_executor(journal, gate, {scaling_stage(open), {}, {}});
    std::latch unused(1);
    EXPECT_EQ(journal_text(run(*replay, gate, unused)), journal_text(journal));
  }
}

TEST(RejectedResult, LoopsAreFoundAgainWithLaterKeyframes) {
  for (const Stage stage : kStages) {
    EXPECT_FALSE(is_repeated(stage, CommitOutcome::kCommitted));
    EXPECT_FALSE(is_repeated(stage, CommitOutcome::kUnchanged));
    EXPECT_FALSE(is_repeated(stage, CommitOutcome::kStopped));
  }
  EXPECT_TRUE(is_repeated(Stage::kMap, CommitOutcome::kRejected));
  EXPECT_FALSE(is_repeated(Stage::kLoop, CommitOutcome::kRejected));
}

}  // namespace
}  // namespace bslam::execution
