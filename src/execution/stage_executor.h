// Decides when and in which thread background stages run, not what they compute. The caller's thread reads and changes
// the map through an executor only.
#pragma once

#include <memory>
#include <stdexcept>

#include "execution/map_gate.h"
#include "execution/options.h"
#include "execution/stage.h"

namespace bslam::execution {

// All functions except interrupt() and over() must be called from one thread, the caller's. An exception of a stage is
// thrown by a call of begin_frame(), commit(), enqueue(), drain() or restart(). With threads (parallel, lagged) all
// further calls of these functions throw it again. Without threads (sequential, replay) only the call that ran the
// stage throws it: the task and those that would follow are lost, so that a replayed run then differs from its journal.
// An executor may be destroyed at any time: running stages are stopped, waiting tasks are dropped.
class StageExecutor {
 public:
  virtual ~StageExecutor() = default;

  // Returns the version of the map that the frame of this time uses. Must be called once per frame, in order.
  virtual map::MapSnapshot begin_frame(FrameId frame, TimeNs time_ns) = 0;

  // Commits an edit of the caller's thread.
  virtual map::CommitReport commit(JournalStep step, map::MapDraft draft) = 0;

  // Records that the level of reduction changed before the next frame (System::set_reduction).
  virtual void note_reduction(int level) = 0;

  // Adds a task of kKeyframe or kMap. May block while too many tasks are waiting.
  virtual void enqueue(const StageTask& task) = 0;
  // The same for the mapping of a committed keyframe.
  void enqueue(KeyframeId keyframe) { enqueue({Stage::kMap, keyframe}); }

  // Returns when all enqueued tasks, and the tasks that follow them, are done and committed.
  virtual void drain() = 0;

  // Drains, then empties the map.
  virtual void restart() = 0;

  // Ends the run; must be called after drain. Throws if the journal of a replayed run has further entries.
  virtual void end() {}

  // Thread-safe. Running stages are stopped and their results discarded, waiting tasks are dropped. From then on
  // only edits of the caller's thread change the map.
  virtual void interrupt() = 0;

  // Thread-safe. Returns true if no stages will run any more: after an interrupt or at the end of a replayed run.
  virtual bool over() const = 0;
};

struct ExecutionSetup {
  StageFunctions functions;
  ExecutionOptions options;
  StageObserver observer;  // may be empty
};

// clang-format off
// Creates the executor of a mode. `gate` must outlive it. Commits may drop or restart tasks of other stages; see superseded_by in
// execution/stage.h.
// - sequential: each stage is run and committed in the caller's thread, within enqueue().
// - parallel: one thread per stage. A task uses the newest version at its start and is committed when it is done.
// - lagged: one thread per stage. The caller's thread determines the base version of a task when it starts, and commits
//   its result at the beginning of the frame `lag` frames later, waiting for it if necessary; then the next task of the
//   stage starts. Results therefore do not depend on the timing of threads. An exception is rethrown when the result is
//   due.
// clang-format on
std::unique_ptr<StageExecutor> make_stage_executor(Mode mode, MapGate& gate, ExecutionSetup setup);

// Thrown if a replayed run differs from its journal; `error` contains the first entry that differs.
struct ReplayMismatch : std::runtime_error {
  explicit ReplayMismatch(Error e) : std::runtime_error(e.message()), error(std::move(e)) {}
  Error error;
};

// Creates an executor that repeats a recorded run: every stage runs in the caller's thread, on the recorded version,
// and is committed in the recorded order. Calls throw ReplayMismatch if the run differs from the journal.
std::unique_ptr<StageExecutor> make_replay_executor(Journal journal, MapGate& gate, ExecutionSetup setup);

}  // namespace bslam::execution
