// When stages run behind tracking, and in which thread; never what they compute. The caller's thread meets the map
// through an executor alone.
#pragma once

#include <memory>
#include <stdexcept>

#include "execution/map_gate.h"
#include "execution/options.h"
#include "execution/stage.h"

namespace bslam::execution {

// All but interrupt() are for one thread, the caller's. Any of its calls may throw what a stage threw in a worker, and
// after that all do. An executor may go at any moment: stages under way are stopped, what waits is dropped.
class StageExecutor {
 public:
  virtual ~StageExecutor() = default;

  // The version of the map that the frame sees. Call once a frame, in order.
  virtual map::MapSnapshot begin_frame(FrameId frame) = 0;

  // An edit of the caller's thread.
  virtual map::CommitReport commit(JournalStep step, map::MapDraft draft) = 0;

  // The stages are due for a keyframe that was committed. May wait where too many are.
  virtual void enqueue(KeyframeId keyframe) = 0;

  // Returns when everything enqueued, and what followed of it, is in the map.
  virtual void drain() = 0;

  // Drains, then leaves the map for another.
  virtual void restart(map::BundledMap initial) = 0;

  // Nothing follows; after drain. Where a replayed run should have gone on, it throws.
  virtual void end() {}

  // From any thread: stages under way are stopped and their results discarded, what waits is dropped, and from then on
  // only the caller's own edits change the map.
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
//   sequential: every stage to its commit, in the caller's thread, at enqueue.
//   parallel: a thread per lane; a task works on the newest version at its start and is committed as soon as it is
//   done. lagged: a thread per lane, but the caller's thread fixes a task's base when it starts, and commits its result
//   at the
//     beginning of the frame `lag` frames later, waiting for it where it is late. A lane's next task starts with that
//     commit. So results do not depend on the threads; an exception appears when the result it stands for is due.
// A result of kLoop supersedes kGlobal: what of it waits or runs is stopped and never committed, and a new one follows.
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
