#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>

#include "base/stopwatch.h"
#include "execution/schedules.h"

namespace bslam::execution {
namespace {

class ParallelExecutor : public StageExecutor {
 public:
  ParallelExecutor(MapGate& gate, ExecutionSetup setup) : gate_(gate), setup_(std::move(setup)) {
    for (const Stage stage : kStages) {
      if (setup_.functions[stage])
        workers_[static_cast<std::size_t>(stage)] = std::jthread([this, stage] { work(stage); });
    }
  }
  ~ParallelExecutor() override { interrupt(); }

  map::MapSnapshot begin_frame(FrameId frame) override {
    rethrow();
    return gate_.begin_frame(frame);
  }

  map::CommitReport commit(JournalStep step, map::MapDraft draft) override {
    rethrow();
    return gate_.commit(step, std::move(draft));
  }

  void enqueue(KeyframeId keyframe) override {
    {
      std::unique_lock lock(mutex_);
      push({Stage::kMap, keyframe}, lock);
    }
    rethrow();
  }

  void drain() override {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return closed_ || idle(); });
    }
    rethrow();
  }

  void restart() override {
    drain();
    gate_.restart();
  }

  void interrupt() override {
    const std::lock_guard lock(mutex_);
    close();
  }

  bool over() const override {
    const std::lock_guard lock(mutex_);
    return closed_;
  }

 private:
  struct Lane {
    std::deque<StageTask> waiting;
    std::optional<std::stop_source> running;  // of the task under way, until what follows of it is enqueued
  };

  Lane& lane(Stage stage) { return lanes_[static_cast<std::size_t>(stage)]; }

  void rethrow() const {
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
  }

  // The functions below: with mutex_ held.

  bool idle() const {
    for (const Lane& l : lanes_) {
      if (!l.waiting.empty() || l.running) return false;
    }
    return true;
  }

  void drop(Lane& l) {
    l.waiting.clear();
    if (l.running) l.running->request_stop();
  }

  // Every wait ends where this was called, so that nobody waits for a lane that will never move.
  void close() {
    closed_ = true;
    for (Lane& l : lanes_) drop(l);
    changed_.notify_all();
  }

  void push(const StageTask& task, std::unique_lock<std::mutex>& lock) {
    Lane& l = lane(task.stage);
    const auto room = static_cast<std::size_t>(setup_.options.max_pending_keyframes);
    changed_.wait(lock, [&] { return closed_ || l.waiting.size() < room; });
    if (closed_) return;
    l.waiting.push_back(task);
    changed_.notify_all();
  }

  // The functions below: without mutex_.

  void work(Stage stage) {
    std::stop_token stop;
    while (const std::optional<StageTask> task = take(stage, stop)) {
      bool committed = false;
      std::exception_ptr failure;
      try {
        committed = run(*task, stop);
      } catch (...) {
        failure = std::current_exception();
      }
      finish(*task, committed, failure, stop);
    }
  }

  // The next task of a lane and the token it is stopped by; none where closed.
  std::optional<StageTask> take(Stage stage, std::stop_token& stop) {
    Lane& l = lane(stage);
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || !l.waiting.empty(); });
    if (closed_) return std::nullopt;
    const StageTask task = l.waiting.front();
    l.waiting.pop_front();
    stop = l.running.emplace().get_token();
    changed_.notify_all();  // there is room
    return task;
  }

  void finish(const StageTask& task, bool committed, const std::exception_ptr& failure, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    if (failure && !stop.stop_requested()) {  // what a stopped task would have answered does not count, however it ends
      failure_ = failure;
      close();
    }
    if (const auto next = following(task, setup_.functions); committed && next) push(*next, lock);
    lane(task.stage).running.reset();
    changed_.notify_all();
  }

  bool run(const StageTask& task, const std::stop_token& stop) {
    const Stopwatch watch;
    const map::MapSnapshot base = gate_.newest();
    StageResult result = setup_.functions[task.stage](task, base, stop);
    // Before the commit: what was not committed by now never is.
    if (const auto superseded = superseded_by(task.stage, result, *gate_.newest())) {
      const std::lock_guard lock(mutex_);
      drop(lane(*superseded));
    }
    const bool committed = gate_.settle(task, base->version(), std::move(result), stop);
    observe(setup_, {task, watch.ms(), committed});
    return committed;
  }

  MapGate& gate_;
  const ExecutionSetup setup_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::array<Lane, kStages.size()> lanes_;  // guarded by mutex_, as the two below
  bool closed_ = false;
  std::exception_ptr failure_;
  std::array<std::jthread, kStages.size()> workers_;  // last: they end before the rest goes
};

}  // namespace

std::unique_ptr<StageExecutor> make_parallel_executor(MapGate& gate, ExecutionSetup setup) {
  return std::make_unique<ParallelExecutor>(gate, std::move(setup));
}

}  // namespace bslam::execution
