// The executors of the modes, one file each, and what they share. For stage_executor.cc.
#pragma once

#include <memory>

#include "execution/stage_executor.h"

namespace bslam::execution {

std::unique_ptr<StageExecutor> make_sequential_executor(MapGate& gate, ExecutionSetup setup);
std::unique_ptr<StageExecutor> make_parallel_executor(MapGate& gate, ExecutionSetup setup);
std::unique_ptr<StageExecutor> make_lagged_executor(MapGate& gate, ExecutionSetup setup);

// Runs a task here and now, to its commit; true where it had something to commit.
bool run_to_commit(const StageTask& task, const map::MapSnapshot& base, MapGate& gate, const ExecutionSetup& setup,
                   const std::stop_token& stop);

// Tells the observer, if there is one.
void observe(const ExecutionSetup& setup, const StageRun& run);

}  // namespace bslam::execution
