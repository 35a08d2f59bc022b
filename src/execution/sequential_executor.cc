#include <deque>

#include "execution/schedules.h"

namespace bslam::execution {
namespace {

class SequentialExecutor : public StageExecutor {
 public:
  SequentialExecutor(MapGate& gate, ExecutionSetup setup) : gate_(gate), setup_(std::move(setup)) {}

  map::MapSnapshot begin_frame(FrameId frame, TimeNs) override { return gate_.begin_frame(frame); }
  map::CommitReport commit(JournalStep step, map::MapDraft draft) override {
    return gate_.commit(step, std::move(draft));
  }

  void note_reduction(int level) override { gate_.note_reduction(level); }

  void enqueue(const StageTask& task) override {
    std::deque<StageTask> tasks = {task};
    for (; !tasks.empty() && !over(); tasks.pop_front()) {
      const CommitOutcome outcome = run_to_commit(tasks.front(), gate_.newest(), gate_, setup_, stop_.get_token());
      if (outcome != CommitOutcome::kCommitted) continue;
      for (const StageTask& next : following(tasks.front(), *gate_.newest(), setup_.functions)) tasks.push_back(next);
    }
  }

  void drain() override {}
  void restart() override { gate_.restart(); }
  void interrupt() override { stop_.request_stop(); }
  bool over() const override { return stop_.stop_requested(); }

 private:
  MapGate& gate_;
  const ExecutionSetup setup_;
  std::stop_source stop_;
};

}  // namespace

std::unique_ptr<StageExecutor> make_sequential_executor(MapGate& gate, ExecutionSetup setup) {
  return std::make_unique<SequentialExecutor>(gate, std::move(setup));
}

}  // namespace bslam::execution
