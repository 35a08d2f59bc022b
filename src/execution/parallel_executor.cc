#include <algorithm>
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

  map::MapSnapshot begin_frame(FrameId frame, TimeNs time_ns) override {
    {
      std::unique_lock lock(mutex_);
      frame_ns_ = time_ns;
      changed_.wait(lock, [this] { return closed_ || (!awaits_any() && !mapping_is_late()); });
    }
    rethrow();
    return gate_.begin_frame(frame);
  }

  map::CommitReport commit(JournalStep step, map::MapDraft draft) override {
    rethrow();
    return gate_.commit(step, std::move(draft));
  }

  void note_reduction(int level) override { gate_.note_reduction(level); }

  void enqueue(const StageTask& task) override {
    {
      std::unique_lock lock(mutex_);
      push({task, frame_ns_}, lock);
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
  struct TimedTask {
    StageTask task;
    TimeNs frame_ns = 0;  // time of the frame that caused it
  };

  struct StageQueue {
    std::deque<TimedTask> waiting;
    // Stop source of the running task, until the task that follows it is enqueued.
    std::optional<std::stop_source> running;
    TimedTask running_task;  // if one is running
    bool restart = false;    // the running task was stopped and must be run again

    bool any_of(const auto& predicate) const {
      return (running && predicate(running_task)) || std::ranges::any_of(waiting, predicate);
    }
  };

  const StageQueue& queue(Stage stage) const { return queues_[static_cast<std::size_t>(stage)]; }
  StageQueue& queue(Stage stage) { return queues_[static_cast<std::size_t>(stage)]; }

  void rethrow() const {
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
  }

  // The functions below require mutex_.

  bool idle() const {
    for (const StageQueue& q : queues_) {
      if (!q.waiting.empty() || q.running) return false;
    }
    return true;
  }

  bool awaits_any() const {
    if (!setup_.options.await_calibration || !setup_.functions[Stage::kCalibrate]) return false;
    const map::MapSnapshot newest = gate_.newest();
    return std::ranges::any_of(queues_, [&](const StageQueue& q) {
      return q.any_of([&](const TimedTask& t) { return awaited(t.task, *newest); });
    });
  }

  bool mapping_is_late() const {
    const double limit_s = setup_.options.await_mapping_s;
    const auto late = [&](const TimedTask& t) { return to_seconds(frame_ns_ - t.frame_ns) > limit_s; };
    return limit_s > 0.0 && (queue(Stage::kKeyframe).any_of(late) || queue(Stage::kMap).any_of(late));
  }

  static void drop(StageQueue& q) {
    q.waiting.clear();
    q.restart = false;
    if (q.running) q.running->request_stop();
  }

  static void stop_to_rerun(StageQueue& q) {
    if (!q.running || q.running->stop_requested()) return;
    q.restart = true;
    q.running->request_stop();
  }

  // Ends every wait, because no task will be run any more.
  void close() {
    closed_ = true;
    for (StageQueue& q : queues_) drop(q);
    changed_.notify_all();
  }

  void push(const TimedTask& timed, std::unique_lock<std::mutex>& lock) {
    StageQueue& q = queue(timed.task.stage);
    const auto room = static_cast<std::size_t>(setup_.options.max_pending_keyframes);
    changed_.wait(lock, [&] { return closed_ || q.waiting.size() < room; });
    if (closed_) return;
    q.waiting.push_back(timed);
    changed_.notify_all();
  }

  // The functions below must be called without mutex_.

  void work(Stage stage) {
    try {
      run_tasks(stage);
    } catch (...) {  // of what is outside of a task, such as for lack of memory
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
      close();
    }
  }

  void run_tasks(Stage stage) {
    std::stop_token stop;
    while (std::optional<TimedTask> timed = take(stage, stop)) {
      for (bool done = false; !done;) {
        CommitOutcome outcome = CommitOutcome::kStopped;
        std::exception_ptr failure;
        try {
          outcome = run(timed->task, stop);
        } catch (...) {
          failure = std::current_exception();
        }
        done = finish(*timed, outcome, failure, stop);
      }
    }
  }

  // Returns the next task of a stage and its stop token, or nullopt if closed.
  std::optional<TimedTask> take(Stage stage, std::stop_token& stop) {
    StageQueue& q = queue(stage);
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || !q.waiting.empty(); });
    if (closed_) return std::nullopt;
    const TimedTask timed = q.waiting.front();
    q.waiting.pop_front();
    stop = q.running.emplace().get_token();
    q.running_task = timed;
    changed_.notify_all();  // the queue has space
    return timed;
  }

  // Ends a run of a task. If the task must be run again, returns false and replaces its stop token.
  bool finish(const TimedTask& timed, CommitOutcome outcome, const std::exception_ptr& failure, std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    StageQueue& q = queue(timed.task.stage);
    if (q.restart && outcome == CommitOutcome::kStopped) {
      q.restart = false;
      stop = q.running.emplace().get_token();
      return false;
    }
    if (failure && !stop.stop_requested()) {  // failures of a stopped task are ignored
      failure_ = failure;
      close();
    }
    if (outcome == CommitOutcome::kCommitted) {
      for (const StageTask& next : following(timed.task, *gate_.newest(), setup_.functions))
        push({next, timed.frame_ns}, lock);
    }
    q.running.reset();
    q.restart = false;
    changed_.notify_all();
    return true;
  }

  // Stops the tasks that a commit supersedes. Called with the commit and before any other, so that no result of these
  // tasks is committed after it.
  void supersede(const Superseded& tasks) {
    const std::lock_guard lock(mutex_);
    for (const Stage stage : tasks.dropped) drop(queue(stage));
    for (const Stage stage : tasks.restarted) stop_to_rerun(queue(stage));
    changed_.notify_all();  // queues have space
  }

  CommitOutcome run(StageTask& task, const std::stop_token& stop) {
    CommitOutcome outcome;
    do {
      outcome = run_once(task, stop);
    } while (is_repeated(task.stage, outcome));
    return outcome;
  }

  CommitOutcome run_once(StageTask& task, const std::stop_token& stop) {
    const Stopwatch watch;
    const map::MapSnapshot base = gate_.newest();
    StageResult result = setup_.functions[task.stage](task, base, stop);
    result.committed = [this, tasks = superseded_by(task.stage, result, *base),
                        then = std::move(result.committed)](const map::CommitReport& report) {
      supersede(tasks);
      if (then) then(report);
    };
    const CommitOutcome outcome = gate_.commit_stage(task, base->version(), std::move(result), stop);
    observe(setup_, {task, watch.ms(), outcome == CommitOutcome::kCommitted});
    return outcome;
  }

  MapGate& gate_;
  const ExecutionSetup setup_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::array<StageQueue, kStages.size()> queues_;  // this and the next three members are guarded by mutex_
  TimeNs frame_ns_ = 0;                            // time of the newest frame
  bool closed_ = false;
  std::exception_ptr failure_;
  std::array<std::jthread, kStages.size()> workers_;  // last member, so that the threads are joined first
};

}  // namespace

std::unique_ptr<StageExecutor> make_parallel_executor(MapGate& gate, ExecutionSetup setup) {
  return std::make_unique<ParallelExecutor>(gate, std::move(setup));
}

}  // namespace bslam::execution
