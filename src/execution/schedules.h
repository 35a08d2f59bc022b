// The executor of each mode, and common functions. Internal to src/execution.
#pragma once

#include <memory>

#include "execution/stage_executor.h"

namespace bslam::execution {

std::unique_ptr<StageExecutor> make_sequential_executor(MapGate& gate, ExecutionSetup setup);
std::unique_ptr<StageExecutor> make_parallel_executor(MapGate& gate, ExecutionSetup setup);
std::unique_ptr<StageExecutor> make_lagged_executor(MapGate& gate, ExecutionSetup setup);

// Runs a task in the calling thread and commits its result. If it was committed, the keyframe of the task is known.
CommitOutcome run_to_commit(StageTask& task, const map::MapSnapshot& base, MapGate& gate, const ExecutionSetup& setup,
                            const std::stop_token& stop);

// Calls the observer, if there is one.
void observe(const ExecutionSetup& setup, const StageRun& run);

}  // namespace bslam::execution
