// A loop closure that moves the map makes a running calibration useless. Its task is run again, and those that wait are
// kept.
#include <gtest/gtest.h>

#include <thread>

#include "execution/stage_world.h"

namespace bslam::execution {
namespace {

StageResult scaled(const map::MapSnapshot& base, double factor) {
  map::MapDraft draft(base);
  EXPECT_TRUE(draft.scale_submap(KeyframeId(0), factor));
  return {std::move(draft), {}};
}

// kLoop scales the map by 2 at keyframe 12, at which the third calibration is due. kCalibrate scales it by 3; before
// the loop is closed it runs until it is stopped.
StageFunctions scaling_stages() {
  StageFunctions functions;
  functions[Stage::kMap] = [](const StageTask&, const map::MapSnapshot& base, const std::stop_token&) {
    return StageResult{map::MapDraft(base), {}};
  };
  functions[Stage::kLoop] = [](const StageTask& task, const map::MapSnapshot& base, const std::stop_token&) {
    return task.keyframe == KeyframeId(12) ? scaled(base, 2.0) : StageResult{};
  };
  functions[Stage::kCalibrate] = [](const StageTask&, const map::MapSnapshot& base, const std::stop_token& stop) {
    const bool before_loop = base->keyframe(KeyframeId(0)).scale < 2;
    while (before_loop && !stop.stop_requested()) std::this_thread::yield();
    return scaled(base, 3.0);
  };
  return functions;
}

// A run with 13 keyframes, then 60 frames without.
Journal run(StageExecutor& executor, MapGate& gate) {
  const StageWorld world;
  for (int i = 0; i < 73; ++i) {
    const map::MapSnapshot seen = executor.begin_frame(FrameId(i), 0);
    if (i < 13) executor.enqueue(world.add_keyframe(FrameId(i), seen, executor));
  }
  executor.drain();
  executor.end();
  EXPECT_DOUBLE_EQ(gate.newest()->keyframe(KeyframeId(0)).scale, 54.0);
  return gate.journal();
}

TEST(SupersededCalibration, AllCalibrationsAreCommittedAfterTheLoop) {
  for (const Mode mode : {Mode::kParallel, Mode::kLagged}) {
    Journal journal;
    {
      map::MapStore store{StageWorld().empty_map()};
      MapGate gate(store);
      ExecutionSetup setup{scaling_stages(), {}, {}};
      setup.options.await_calibration = false;
      journal = run(*make_stage_executor(mode, gate, std::move(setup)), gate);
    }
    std::vector<std::int32_t> calibrations;
    MapVersion loop{0};
    for (const JournalEntry& e : journal.entries) {
      if (e.step == JournalStep::kLoop && e.committed) loop = *e.committed;
      if (e.step != JournalStep::kCalibrate) continue;
      calibrations.push_back(e.input);
      EXPECT_TRUE(e.committed);
      EXPECT_GE(e.base, loop);
    }
    EXPECT_EQ(calibrations, (std::vector<std::int32_t>{4, 8, 12})) << "mode " << static_cast<int>(mode);
    map::MapStore store{StageWorld().empty_map()};
    MapGate gate(store);
    const auto replay = make_replay_executor(journal, gate, {scaling_stages(), {}, {}});
    EXPECT_EQ(journal_text(run(*replay, gate)), journal_text(journal));
  }
}

// The second run is interrupted while it goes on.
TEST(SupersededCalibration, AnInterruptEndsItsSecondRun) {
  for (const Mode mode : {Mode::kParallel, Mode::kLagged}) {
    map::MapStore store{StageWorld().empty_map()};
    MapGate gate(store);
    ExecutionSetup setup{scaling_stages(), {}, {}};
    setup.options.await_calibration = false;
    setup.functions[Stage::kCalibrate] = [](const StageTask&, const map::MapSnapshot& base,
                                            const std::stop_token& stop) {
      while (!stop.stop_requested()) std::this_thread::yield();
      return scaled(base, 3.0);
    };
    const auto executor = make_stage_executor(mode, gate, std::move(setup));
    const StageWorld world;
    for (int i = 0; i < 13; ++i)
      executor->enqueue(world.add_keyframe(FrameId(i), executor->begin_frame(FrameId(i), 0), *executor));
    int frame = 13;
    while (gate.newest()->keyframe(KeyframeId(0)).scale < 2) executor->begin_frame(FrameId(frame++), 0);
    executor->interrupt();
    executor->drain();
    EXPECT_DOUBLE_EQ(gate.newest()->keyframe(KeyframeId(0)).scale, 2.0);
  }
}

}  // namespace
}  // namespace bslam::execution
