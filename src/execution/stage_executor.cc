#include "execution/stage_executor.h"

#include "base/stopwatch.h"
#include "execution/schedules.h"

namespace bslam::execution {

std::unique_ptr<StageExecutor> make_stage_executor(Mode mode, MapGate& gate, ExecutionSetup setup) {
  BSLAM_ASSERT(setup.functions[Stage::kMap], "the mapping stage must be configured");
  switch (mode) {
    case Mode::kSequential:
      return make_sequential_executor(gate, std::move(setup));
    case Mode::kParallel:
      return make_parallel_executor(gate, std::move(setup));
    case Mode::kLagged:
      return make_lagged_executor(gate, std::move(setup));
  }
  return nullptr;
}

CommitOutcome run_to_commit(StageTask& task, const map::MapSnapshot& base, MapGate& gate, const ExecutionSetup& setup,
                            const std::stop_token& stop) {
  const Stopwatch watch;
  StageResult result = setup.functions[task.stage](task, base, stop);
  const CommitOutcome outcome = gate.commit_stage(task, base->version(), std::move(result), stop);
  observe(setup, {task, watch.ms(), outcome == CommitOutcome::kCommitted});
  return outcome;
}

void observe(const ExecutionSetup& setup, const StageRun& run) {
  if (setup.observer) setup.observer(run);
}

}  // namespace bslam::execution
