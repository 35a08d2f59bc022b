// Decides when and in which thread background stages run, never what they compute. The caller's thread reads and
// changes the map through an executor only.
#pragma once

#include <memory>
#include <stdexcept>

#include "execution/map_gate.h"
#include "execution/options.h"
#include "execution/stage.h"

namespace bslam::execution {

// All functions but interrupt() and over() are for one thread, the caller's. Any of its calls may throw what a stage
// threw in a worker; after that all of them do. An executor may be destroyed at any time: running stages are stopped,
// waiting tasks are dropped.
class StageExecutor {
 public:
  virtual ~StageExecutor() = default;

  // The version of the map that the frame sees. Call once a frame, in order.
  virtual map::MapSnapshot begin_frame(FrameId frame) = 0;

  // An edit of the caller's thread.
  virtual map::CommitReport commit(JournalStep step, map::MapDraft draft) = 0;

  // Hands a committed keyframe to the stages. May block while too many tasks are waiting.
  virtual void enqueue(KeyframeId keyframe) = 0;

  // Returns when all tasks enqueued, and those that followed them, are done and committed.
  virtual void drain() = 0;

  // Drains, then empties the map.
  virtual void restart() = 0;

  // The run is over; call after drain. Throws where a replayed run should have gone on.
  virtual void end() {}

  // From any thread: running stages are stopped and their results discarded, waiting tasks are dropped. From then on
  // only edits of the caller's thread change the map.
  virtual void interrupt() = 0;

  // No stages will run any more: interrupted, or a replayed run ended here.
  virtual bool over() const = 0;
};

struct ExecutionSetup {
  StageFunctions functions;
  ExecutionOptions options;
  StageObserver observer;  // may be empty
};

// The executor of a mode. `gate` outlives it.
//   sequential: each stage runs to its commit in the caller's thread, within enqueue().
//   parallel:   one thread per stage; a task works on the newest version at its start and is committed as soon as it is
//   done. lagged:     one thread per stage, but the caller's thread fixes the base of a task when it starts, and
//   commits its result
//               at the beginning of the frame `lag` frames later, waiting for it if necessary; then the next task of
//               the stage starts. So results do not depend on threads; an exception appears when the result was due.
// Which results drop tasks of other stages: superseded_by (execution/stage.h).
std::unique_ptr<StageExecutor> make_stage_executor(Mode mode, MapGate& gate, ExecutionSetup setup);

// A run that is not the one its journal tells of; `error` names the first entry that differs.
struct ReplayMismatch : std::runtime_error {
  explicit ReplayMismatch(Error e) : std::runtime_error(e.message()), error(std::move(e)) {}
  Error error;
};

// Repeats a recorded run: every stage in the caller's thread, on the recorded version, committed in the recorded order.
// Calls throw ReplayMismatch where the run differs from the journal.
std::unique_ptr<StageExecutor> make_replay_executor(Journal journal, MapGate& gate, ExecutionSetup setup);

}  // namespace bslam::execution
