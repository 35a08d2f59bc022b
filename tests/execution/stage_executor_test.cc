#include "execution/stage_executor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <semaphore>
#include <thread>

#include "execution/stage_world.h"

namespace bslam::execution {
namespace {

constexpr execution::Mode kModes[] = {execution::Mode::kSequential, execution::Mode::kParallel,
                                      execution::Mode::kLagged};

// Keeps the processor busy with threads during its lifetime.
class Load {
 public:
  explicit Load(int threads) {
    for (int i = 0; i < threads; ++i) {
      threads_.emplace_back([](const std::stop_token& stop) {
        while (!stop.stop_requested() && busy(10'000) > 0) {
        }
      });
    }
  }

 private:
  std::vector<std::jthread> threads_;
};

ExecutionSetup setup(StageFunctions functions, StageObserver observer = {}) {
  ExecutionSetup out{std::move(functions), {}, std::move(observer)};
  out.options.lag_global = 12;
  out.options.await_calibration = false;
  return out;
}

// A store with a gate, and an executor on it.
struct WorldRun {
  WorldRun(execution::Mode mode, ExecutionSetup s) : executor(make_stage_executor(mode, gate, std::move(s))) {}
  WorldRun(Journal journal, ExecutionSetup s)
      : executor(make_replay_executor(std::move(journal), gate, std::move(s))) {}

  StageWorld world;
  map::MapStore store{world.empty_map()};
  MapGate gate{store};
  std::unique_ptr<StageExecutor> executor;
  int frames = 0;
  std::vector<std::uint64_t> seen = {};  // hash of the version used by every frame

  KeyframeId frame_with_keyframe() {
    const map::MapSnapshot map = executor->begin_frame(FrameId(frames), 0);
    seen.push_back(hash_of(*map, 0));
    const KeyframeId k = world.add_keyframe(FrameId(frames++), map, *executor);
    executor->enqueue(k);
    return k;
  }
  void frame_with_deferred_keyframe() {
    const FrameId frame(frames);
    frame_without();
    executor->enqueue({Stage::kKeyframe, KeyframeId(), frame});
  }
  void frame_without() { seen.push_back(hash_of(*executor->begin_frame(FrameId(frames++), 0), 0)); }

  // A complete run with keyframes in two of three frames, half of them created by a stage, and a restart with an empty
  // map in the middle.
  void whole(int count = 60) {
    for (int half = 0; half < 2; ++half) {
      for (int i = 0; i < count / 2; ++i) {
        if (i % 3 == 0) frame_with_keyframe();
        if (i % 3 == 1) frame_without();
        if (i % 3 == 2) frame_with_deferred_keyframe();
      }
      if (half == 0) executor->restart();
    }
    executor->drain();
    executor->end();
    EXPECT_EQ(gate.newest()->check_invariants(), std::nullopt);
    seen.push_back(hash_of(*gate.newest(), 0));
  }
  std::string journal() const { return journal_text(gate.journal()); }
};

std::size_t count(const Journal& journal, JournalStep step) {
  return static_cast<std::size_t>(std::count_if(journal.entries.begin(), journal.entries.end(),
                                                [&](const JournalEntry& e) { return e.step == step; }));
}

// Number of background results whose base was not the newest version when they were committed.
std::size_t superseded(const Journal& journal) {
  MapVersion newest{0};
  std::size_t n = 0;
  for (const JournalEntry& e : journal.entries) {
    n += background_stage(e.step) && e.base != newest;
    if (e.committed) newest = *e.committed;
  }
  return n;
}

TEST(StageExecutorParallel, FramesUseTheFirstMapsAndCalibrations) {
  for (const Mode mode : kModes) {
    ExecutionSetup s = setup(hashing_stages(7));
    s.options.await_calibration = true;
    s.functions[Stage::kLoop] = {};
    WorldRun run(mode, std::move(s));
    for (int i = 0; i < 12; ++i) {
      run.frame_with_keyframe();
      // The version after the keyframe, its mapping and, after the fourth and the eighth one, a calibration.
      const MapVersion committed = run.store.snapshot()->version();
      const map::MapSnapshot next = run.executor->begin_frame(FrameId(1000 + i), 0);
      EXPECT_GE(next->version(), committed);
      EXPECT_EQ(next->version().value(), 2 * (i + 1) + (i >= 4 ? 1 : 0) + (i >= 8 ? 1 : 0))
          << "mode " << static_cast<int>(mode);
    }
    run.executor->drain();
  }
}

TEST(StageExecutorParallel, FramesAwaitTheMappingOfEarlierKeyframesInRecordedTime) {
  StageFunctions functions = hashing_stages(7);
  functions[Stage::kCalibrate] = functions[Stage::kLoop] = {};
  std::binary_semaphore mapping{0};
  functions[Stage::kMap] = [real = functions[Stage::kMap], &mapping](const auto& task, const auto& base,
                                                                     const auto& stop) {
    mapping.acquire();
    EXPECT_GT(busy(3'000'000), 0.0);
    return real(task, base, stop);
  };
  for (const bool deferred : {false, true}) {
    ExecutionSetup s = setup(functions);
    s.options.await_mapping_s = 0.15;
    WorldRun run(Mode::kParallel, std::move(s));
    if (deferred) {  // a stage creates a keyframe from features of one that exists
      mapping.release();
      run.frame_with_keyframe();
      run.executor->drain();
    }
    const std::int32_t before = run.store.snapshot()->version().value();
    deferred ? run.frame_with_deferred_keyframe() : static_cast<void>(run.frame_with_keyframe());
    run.executor->begin_frame(FrameId(100), 140'000'000);  // does not wait for the mapping, which has not begun
    mapping.release();
    const map::MapSnapshot seen = run.executor->begin_frame(FrameId(101), 160'000'000);
    EXPECT_EQ(seen->version().value(), before + 2) << deferred;  // the keyframe and its mapping
    run.executor->drain();
  }
}

TEST(MapGate, KeepsNoJournalIfDisabled) {
  const StageWorld world;
  map::MapStore store{world.empty_map()};
  MapGate gate(store, false);
  const auto executor = make_stage_executor(execution::Mode::kSequential, gate, setup(hashing_stages(1)));
  executor->enqueue(world.add_keyframe(FrameId(0), executor->begin_frame(FrameId(0), 0), *executor));
  EXPECT_GT(gate.newest()->version(), MapVersion(1));
  EXPECT_TRUE(gate.journal().entries.empty());
}

TEST(StageExecutorSequential, RunsTheFollowingStagesBeforeItReturns) {
  WorldRun run(execution::Mode::kSequential, setup(hashing_stages(1, 2)));
  run.frame_with_keyframe();
  EXPECT_EQ(run.journal(),
            "bslam-journal 1\n0 frame 0 0 -\n1 track 0 0 1\n2 map 0 1 2\n3 loop 0 2 3\n4 global 0 3 4\n");
  run.frame_with_keyframe();  // no loop there
  EXPECT_EQ(run.gate.journal().entries.back(), (JournalEntry{JournalStep::kLoop, 1, MapVersion(6), std::nullopt}));
}

TEST(StageExecutorSequential, TheKeyframeThatAStageHasCreatedIsMapped) {
  std::vector<StageTask> observed;
  StageFunctions functions = hashing_stages(1, 1);
  functions[Stage::kLoop] = {};
  const auto observer = [&](const StageRun& r) { observed.push_back(r.task); };
  WorldRun run(execution::Mode::kSequential, setup(functions, observer));
  run.frame_with_keyframe();
  run.frame_with_deferred_keyframe();
  EXPECT_EQ(
      run.journal(),
      "bslam-journal 1\n0 frame 0 0 -\n1 track 0 0 1\n2 map 0 1 2\n3 frame 1 2 -\n4 keyframe 1 2 3\n5 map 1 3 4\n");
  EXPECT_EQ(observed, (std::vector<StageTask>{{Stage::kMap, KeyframeId(0)},
                                              {Stage::kKeyframe, KeyframeId(1), FrameId(1)},
                                              {Stage::kMap, KeyframeId(1)}}));
}

TEST(StageExecutorSequential, SkipsStagesThatAreNotConfigured) {
  StageFunctions functions = hashing_stages(1, 1);
  functions[Stage::kLoop] = {};
  for (const execution::Mode mode : kModes) {
    WorldRun run(mode, setup(functions));
    run.whole(12);
    EXPECT_EQ(count(run.gate.journal(), JournalStep::kMap), 8u);
    EXPECT_EQ(count(run.gate.journal(), JournalStep::kLoop) + count(run.gate.journal(), JournalStep::kGlobal), 0u);
  }
}

TEST(StageExecutorLagged, MapsDoNotDependOnTheDurationOfStages) {
  WorldRun quick(execution::Mode::kLagged, setup(hashing_stages(0, 3, 0)));
  quick.whole();
  EXPECT_GT(superseded(quick.gate.journal()), 10u);
  for (const int load : {0, 1, 3}) {
    const Load others(load);
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      WorldRun run(execution::Mode::kLagged, setup(hashing_stages(seed)));
      run.whole();
      ASSERT_EQ(run.journal(), quick.journal()) << "delays " << seed << ", load " << load;
      ASSERT_EQ(run.seen, quick.seen) << "delays " << seed << ", load " << load;
    }
  }
}

TEST(StageExecutorLagged, ResultsAreUsedAfterTheConfiguredNumberOfFrames) {
  for (const int lag : {1, 2, 7}) {
    ExecutionSetup s = setup(hashing_stages(1, 1));
    s.options.lag_map = lag;
    s.options.lag_loop = lag + 1;
    s.options.lag_global = 3;
    WorldRun run(execution::Mode::kLagged, std::move(s));
    run.frame_with_keyframe();
    for (int i = 0; i < 3 * lag + 4; ++i) run.frame_without();
    const std::vector<JournalEntry> entries = run.gate.journal().entries;
    const auto frame_after = [&](JournalStep step) {
      const auto at =
          std::find_if(entries.begin(), entries.end(), [&](const JournalEntry& e) { return e.step == step; });
      return at == entries.end() ? -1 : std::next(at)->input;
    };
    EXPECT_EQ(frame_after(JournalStep::kMap), lag);
    EXPECT_EQ(frame_after(JournalStep::kLoop), lag + lag + 1);
    EXPECT_EQ(frame_after(JournalStep::kGlobal), lag + lag + 1 + 3);
  }
}

TEST(StageExecutorLagged, CommitsEarlyIfAQueueIsFull) {
  ExecutionSetup s = setup(hashing_stages(1));
  s.options.lag_map = s.options.lag_loop = 1000;
  s.options.max_pending_keyframes = 2;
  WorldRun run(execution::Mode::kLagged, std::move(s));
  for (int i = 0; i < 3; ++i) run.frame_with_keyframe();  // one runs, two wait
  EXPECT_EQ(count(run.gate.journal(), JournalStep::kMap), 0u);
  for (int i = 0; i < 7; ++i) run.frame_with_keyframe();
  EXPECT_EQ(count(run.gate.journal(), JournalStep::kMap), 7u);
  EXPECT_EQ(count(run.gate.journal(), JournalStep::kLoop), 4u);
}

TEST(StageExecutorReplay, RepeatsParallelRunsExactly) {
  // At least 40 runs, and more if the threads were scheduled one after the other, which makes the order trivial.
  constexpr std::size_t kOutOfOrder = 40;
  std::size_t out_of_order = 0, globals = 0;
  for (std::uint64_t seed = 1; seed <= 40 || (out_of_order <= kOutOfOrder && seed <= 2000); ++seed) {
    WorldRun recorded(execution::Mode::kParallel, setup(hashing_stages(seed)));
    recorded.whole();
    const auto journal = parse_journal(recorded.journal(), "recorded");
    ASSERT_TRUE(journal.ok()) << journal.error().message();
    WorldRun replayed(*journal, setup(hashing_stages(seed + 100)));
    replayed.whole();
    ASSERT_EQ(replayed.journal(), recorded.journal()) << seed;
    ASSERT_EQ(replayed.seen, recorded.seen) << seed;
    out_of_order += superseded(*journal);
    globals += count(*journal, JournalStep::kGlobal);
  }
  EXPECT_GT(out_of_order, kOutOfOrder);
  EXPECT_GT(globals, 40u);
}

TEST(StageExecutorReplay, RepeatsTheOtherModes) {
  for (const execution::Mode mode : {execution::Mode::kSequential, execution::Mode::kLagged}) {
    WorldRun recorded(mode, setup(hashing_stages(1)));
    recorded.whole();
    WorldRun replayed(recorded.gate.journal(), setup(hashing_stages(2)));
    replayed.whole();
    EXPECT_EQ(replayed.journal(), recorded.journal());
    EXPECT_EQ(replayed.seen, recorded.seen);
  }
}

// Error of a replay of a changed journal; empty if it succeeds.
std::string complaint(const Journal& journal, int loop_every = 3) {
  WorldRun run(journal, setup(hashing_stages(1, loop_every, 0)));
  try {
    run.whole(24);
  } catch (const ReplayMismatch& mismatch) {
    return mismatch.error.key + ": found " + mismatch.error.found;
  }
  return {};
}

TEST(StageExecutorReplay, ReportsTheFirstEntryThatDiffers) {
  WorldRun recorded(execution::Mode::kLagged, setup(hashing_stages(1)));
  recorded.whole(24);
  const Journal good = recorded.gate.journal();
  EXPECT_EQ(complaint(good), "");
  for (std::size_t i = 0; i < good.entries.size(); ++i) {
    const std::string entry = "entry " + std::to_string(i);
    Journal bad = good;
    bad.entries[i].input += 1;
    EXPECT_EQ(complaint(bad), entry + ": found " + entry_text(bad.entries[i]));
    bad = good;
    bad.entries[i].step = good.entries[i].step == JournalStep::kFinal ? JournalStep::kStart : JournalStep::kFinal;
    EXPECT_EQ(complaint(bad), entry + ": found " + entry_text(bad.entries[i]));
    bad = good;
    bad.entries[i].base = MapVersion(100'000);  // none yet
    EXPECT_EQ(complaint(bad), entry + ": found " + entry_text(bad.entries[i]));
    bad = good;
    bad.entries.resize(i);
    const bool only_stages = std::all_of(good.entries.begin() + static_cast<std::ptrdiff_t>(i), good.entries.end(),
                                         [](const JournalEntry& e) { return background_stage(e.step).has_value(); });
    EXPECT_EQ(complaint(bad), only_stages ? "" : "entry " + std::to_string(i) + ": found the end") << "ends there";
  }
  Journal longer = good;
  longer.entries.push_back({JournalStep::kFrame, 24, MapVersion(3), std::nullopt});
  EXPECT_EQ(complaint(longer), "entry " + std::to_string(good.entries.size()) + ": found frame 24 3 -");
  EXPECT_NE(complaint(good, 5), "");  // other stages
}

TEST(StageExecutorReplay, ReportsTasksLeftBeforeTheFinalStep) {
  WorldRun recorded(execution::Mode::kSequential, setup(hashing_stages(1)));
  recorded.frame_with_keyframe();
  Journal journal = recorded.gate.journal();
  journal.entries.erase(journal.entries.begin() + 2, journal.entries.end());  // never mapped
  journal.entries.push_back({JournalStep::kFinal, 0, MapVersion(1), MapVersion(2)});
  WorldRun run(journal, setup(hashing_stages(1)));
  run.frame_with_keyframe();
  run.executor->drain();
  EXPECT_THROW(run.executor->commit(JournalStep::kFinal, map::MapDraft(run.gate.newest())), ReplayMismatch);
}

// A kGlobal stage that runs until it is stopped.
StageFunctions endless_global(std::atomic<int>& started, std::atomic<int>& stopped) {
  StageFunctions functions = hashing_stages(1, 1, 0);
  functions[Stage::kGlobal] = [&, real = functions[Stage::kGlobal]](const StageTask& task, const map::MapSnapshot& base,
                                                                    const std::stop_token& stop) {
    ++started;
    started.notify_all();
    while (!stop.stop_requested()) std::this_thread::yield();
    ++stopped;
    return real(task, base, {});
  };
  return functions;
}

TEST(StageExecutorParallel, ACorrectionSupersedesTheGlobalStage) {
  for (const execution::Mode mode : {execution::Mode::kParallel, execution::Mode::kLagged}) {
    std::atomic<int> started = 0, stopped = 0;
    WorldRun run(mode, setup(endless_global(started, stopped)));
    run.frame_with_keyframe();
    for (int i = 0; i < 9; ++i) run.frame_without();
    started.wait(0);
    EXPECT_EQ(stopped, 0);
    run.frame_with_keyframe();
    for (int i = 0; i < 9; ++i) run.frame_without();
    while (stopped == 0) std::this_thread::yield();
    started.wait(1);  // the next one
    EXPECT_EQ(count(run.gate.journal(), JournalStep::kGlobal), 0u);
    EXPECT_EQ(count(run.gate.journal(), JournalStep::kLoop), 2u);
    run.executor->interrupt();
    run.executor->drain();
    EXPECT_EQ(count(run.gate.journal(), JournalStep::kGlobal), 0u);
  }
}

TEST(StageExecutorParallel, QueuesAreBounded) {
  for (const int room : {1, 3}) {
    std::atomic<int> mapped = 0, closed = 0;
    StageFunctions functions = hashing_stages(3, 2);
    const auto count_results = [&functions](Stage stage, std::atomic<int>& counter) {
      functions[stage] = [real = functions[stage], &counter](const auto& task, const auto& base, const auto& stop) {
        StageResult result = real(task, base, stop);
        ++counter;
        return result;
      };
    };
    count_results(Stage::kMap, mapped);
    count_results(Stage::kLoop, closed);
    ExecutionSetup s = setup(functions);
    s.options.max_pending_keyframes = room;
    WorldRun run(execution::Mode::kParallel, std::move(s));
    for (int enqueued = 1; enqueued <= 40; ++enqueued) {
      run.frame_with_keyframe();
      const int looped = closed, done = mapped;
      EXPECT_LE(enqueued - done, room + 1);            // waiting and under way
      EXPECT_LE(enqueued - looped, 2 * room + 2 + 1);  // in both queues, and one that waits for the next
    }
    run.executor->drain();
    EXPECT_EQ(mapped, 40);
    EXPECT_EQ(closed, 40);
  }
}

TEST(StageExecutorParallel, CanBeDestroyedAtAnyTime) {
  Random random(11);
  for (int i = 0; i < 50; ++i) {
    for (const execution::Mode mode : {execution::Mode::kParallel, execution::Mode::kLagged}) {
      ExecutionSetup s = setup(hashing_stages(static_cast<std::uint64_t>(i), 2, 30'000));
      s.options.max_pending_keyframes = 1 + static_cast<int>(random.below(3));
      s.options.lag_map = 1 + static_cast<int>(random.below(3));
      WorldRun run(mode, std::move(s));
      const int end = static_cast<int>(random.below(15));
      for (int f = 0; f < end; ++f) run.frame_with_keyframe();
      if (random.below(2) == 0) run.executor->drain();
      busy(random.below(30'000));
      run.executor.reset();
      EXPECT_EQ(run.gate.newest()->check_invariants(), std::nullopt);
      EXPECT_TRUE(parse_journal(run.journal(), "").ok());
    }
  }
}

TEST(StageExecutorParallel, RethrowsAnExceptionOfAnyStageInTheCaller) {
  Random random(12);
  for (int i = 0; i < 50; ++i) {
    for (const execution::Mode mode : kModes) {
      const Stage bad = std::array{Stage::kMap, Stage::kLoop, Stage::kGlobal}[random.below(3)];
      const KeyframeId victim(static_cast<int>(random.below(6)));
      StageFunctions functions = hashing_stages(static_cast<std::uint64_t>(i), 1, 3'000);
      functions[Stage::kCalibrate] = {};  // may drop the last task of kGlobal
      functions[bad] = [real = functions[bad], victim](const auto& task, const auto& base, const auto& stop) {
        if (task.keyframe >= victim) throw std::runtime_error("stage failed");
        return real(task, base, stop);
      };
      ExecutionSetup s = setup(functions);
      s.options.max_pending_keyframes = 1;
      WorldRun run(mode, std::move(s));
      EXPECT_THROW(
          {
            for (int f = 0; f < 10; ++f) run.frame_with_keyframe();
            run.executor->drain();
          },
          std::runtime_error);
      if (mode == execution::Mode::kSequential) continue;
      EXPECT_THROW(run.executor->begin_frame(FrameId(99), 0), std::runtime_error);
      EXPECT_THROW(run.executor->enqueue(KeyframeId(0)), std::runtime_error);
      EXPECT_THROW(run.executor->drain(), std::runtime_error);
    }
  }
}

TEST(StageExecutorParallel, AnInterruptFromAnotherThreadEndsEveryWait) {
  for (const execution::Mode mode : {execution::Mode::kParallel, execution::Mode::kLagged}) {
    std::atomic<int> started = 0, stopped = 0;
    StageFunctions functions = endless_global(started, stopped);
    functions[Stage::kMap] = functions[Stage::kGlobal];
    WorldRun run(mode, setup(functions));
    run.frame_with_keyframe();
    std::jthread interrupter([&] {
      started.wait(0);
      run.executor->interrupt();
    });
    for (int i = 0; i < 30; ++i) run.frame_with_keyframe();  // more than the queue takes
    run.executor->drain();
    EXPECT_TRUE(run.executor->over());
    EXPECT_EQ(run.gate.newest()->num_keyframes(), 31u);  // edits of the caller are committed
    EXPECT_EQ(count(run.gate.journal(), JournalStep::kMap), 0u);
  }
}

TEST(StageExecutorLagged, DiscardsAResultThatWasDoneButNotDueWhenInterrupted) {
  std::atomic<int> mapped = 0;
  StageFunctions functions = hashing_stages(1, 3, 0);
  functions[Stage::kMap] = [&, real = functions[Stage::kMap]](const auto& task, const auto& base, const auto& stop) {
    StageResult result = real(task, base, stop);
    mapped = 1;
    mapped.notify_all();
    return result;
  };
  ExecutionSetup s = setup(functions);
  s.options.lag_map = 1000;
  WorldRun run(execution::Mode::kLagged, std::move(s));
  run.frame_with_keyframe();
  mapped.wait(0);
  EXPECT_GT(busy(1'000'000), 0);  // the worker returns from the stage meanwhile
  run.executor->interrupt();
  run.executor->drain();
  EXPECT_EQ(count(run.gate.journal(), JournalStep::kMap), 0u);
  EXPECT_EQ(run.gate.newest()->version(), MapVersion(1));
}

TEST(StageExecutorLagged, ObservesAnInterruptedTaskOnceAndIgnoresItsException) {
  std::atomic<int> begun = 0, observed = 0;
  StageFunctions functions = hashing_stages(1, 3, 0);
  functions[Stage::kMap] = [&](const auto&, const auto&, const std::stop_token& stop) -> StageResult {
    begun = 1;
    begun.notify_all();
    while (!stop.stop_requested()) std::this_thread::yield();
    throw std::runtime_error("stopped");
  };
  WorldRun run(execution::Mode::kLagged, setup(functions, [&](const StageRun& r) {
                 EXPECT_FALSE(r.committed);
                 ++observed;
                 observed.notify_all();
               }));
  run.frame_with_keyframe();
  begun.wait(0);
  run.executor->interrupt();
  observed.wait(0);
  EXPECT_NO_THROW(run.executor->drain());
  EXPECT_NO_THROW(run.frame_with_keyframe());
  EXPECT_EQ(observed, 1);
}

TEST(StageExecutorParallel, AnObserverMayInterrupt) {
  for (const execution::Mode mode : kModes) {
    std::atomic<StageExecutor*> executor = nullptr;
    WorldRun run(mode, setup(hashing_stages(1, 1), [&](const StageRun& r) {
                   if (r.task.stage == Stage::kLoop) executor.load()->interrupt();
                 }));
    executor = run.executor.get();
    for (int i = 0; i < 10; ++i) run.frame_with_keyframe();
    run.executor->drain();
    EXPECT_TRUE(run.executor->over());
    EXPECT_LE(count(run.gate.journal(), JournalStep::kGlobal), 1u);
    run.executor.reset();
  }
}

// A global adjustment that a second loop stops is observed by its worker.
TEST(StageExecutorLagged, AnObserverInAWorkerMayInterruptOrThrow) {
  for (const bool throws : {false, true}) {
    std::atomic<int> begun = 0, stopped = 0;
    std::atomic<bool> told = false;
    std::atomic<StageExecutor*> executor = nullptr;
    const auto observer = [&](const StageRun& r) {
      if (r.task.stage != Stage::kGlobal || told.exchange(true)) return;
      told.notify_all();
      if (throws) throw std::runtime_error("observer failed");
      executor.load()->interrupt();
    };
    ExecutionSetup s = setup(endless_global(begun, stopped), observer);
    s.options.lag_global = 1'000'000;  // the endless task never becomes due, however late the exception arrives
    WorldRun run(execution::Mode::kLagged, std::move(s));
    executor = run.executor.get();
    const auto second_loop = [&] {
      run.frame_with_keyframe();
      for (int i = 0; i < 9; ++i) run.frame_without();
      begun.wait(0);
      run.frame_with_keyframe();
      for (int i = 0; i < 9; ++i) run.frame_without();
      told.wait(false);
      for (int i = 0; throws && i < 100'000; ++i) {  // until the exception is there
        std::this_thread::yield();
        run.frame_without();
      }
    };
    if (throws) {
      EXPECT_THROW(second_loop(), std::runtime_error);
    } else {
      second_loop();
      while (!run.executor->over()) std::this_thread::yield();
    }
    run.executor.reset();
  }
}

TEST(StageExecutorReplay, RepeatsAnInterruptedRunUntilTheInterrupt) {
  for (const execution::Mode mode : kModes) {
    WorldRun recorded(mode, setup(hashing_stages(1)));
    for (int i = 0; i < 12; ++i) recorded.frame_with_keyframe();
    recorded.executor->interrupt();
    recorded.frame_with_keyframe();
    recorded.executor->drain();
    WorldRun replayed(recorded.gate.journal(), setup(hashing_stages(1)));
    for (int i = 0; i < 13; ++i) replayed.frame_with_keyframe();
    replayed.executor->drain();
    EXPECT_TRUE(replayed.executor->over());
    replayed.executor->end();
    EXPECT_EQ(replayed.journal(), recorded.journal());
    EXPECT_EQ(replayed.seen, recorded.seen);
  }
}

TEST(StageExecutorParallel, ReportsCommitsInOrderAndAllRuns) {
  for (const execution::Mode mode : kModes) {
    std::vector<MapVersion> versions;  // callbacks are not concurrent
    std::atomic<int> runs = 0, commits = 0;
    StageFunctions functions = hashing_stages(4);
    for (const Stage stage : kStages) {
      functions[stage] = [real = functions[stage], &versions](const auto& task, const auto& base, const auto& stop) {
        StageResult result = real(task, base, stop);
        result.committed = [&versions](const map::CommitReport& report) {
          versions.push_back(report.published->version());
        };
        return result;
      };
    }
    WorldRun run(mode, setup(functions, [&](const StageRun& r) {
                   EXPECT_GE(r.ms, 0.0);
                   ++runs;
                   commits += r.committed;
                 }));
    run.whole(30);
    EXPECT_TRUE(std::is_sorted(versions.begin(), versions.end()));
    EXPECT_EQ(versions.size(), static_cast<std::size_t>(commits));
    run.executor.reset();  // superseded runs may be reported late
    EXPECT_GE(runs, 40);   // 20 of mapping, 20 of loop closing
    EXPECT_GT(runs, commits);
  }
}

}  // namespace
}  // namespace bslam::execution
