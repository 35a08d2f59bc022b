#include <condition_variable>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

#include "base/stopwatch.h"
#include "execution/schedules.h"

namespace bslam::execution {
namespace {

// One run of a stage. The worker stores the result or the failure, then sets `done`.
struct Job {
  StageTask task;
  map::MapSnapshot base;
  int started = 0;  // number of frames begun until then
  std::stop_source stop;
  StageResult result;
  std::exception_ptr failure;
  double ms = 0;
  bool done = false;      // guarded by the executor's mutex, as the one below
  bool observed = false;  // reported by the worker, because the job was stopped before it was done
};

// Runs the jobs of a stage one after the other.
struct Worker {
  std::deque<std::shared_ptr<Job>> queue;  // at most one job, which waits if a superseded one is still running
  std::jthread thread;
};

class LaggedExecutor : public StageExecutor {
 public:
  LaggedExecutor(MapGate& gate, ExecutionSetup setup) : gate_(gate), setup_(std::move(setup)) {
    for (const Stage stage : kStages) {
      if (setup_.functions[stage]) worker(stage).thread = std::jthread([this, stage] { work(worker(stage)); });
    }
  }
  ~LaggedExecutor() override { interrupt(); }

  map::MapSnapshot begin_frame(FrameId frame, TimeNs) override {
    rethrow();
    ++now_;
    while (finish_due()) {
    }
    return gate_.begin_frame(frame);
  }

  map::CommitReport commit(JournalStep step, map::MapDraft draft) override {
    rethrow();
    return gate_.commit(step, std::move(draft));
  }

  void note_reduction(int level) override { gate_.note_reduction(level); }

  void enqueue(const StageTask& task) override {
    rethrow();
    push(task);
  }

  void drain() override {
    rethrow();
    for (const Stage stage : kStages) {  // a stage only creates tasks of later stages
      while (queue(stage).running) finish_running(stage);
    }
  }

  void restart() override {
    drain();
    gate_.restart();
  }

  void interrupt() override {
    const std::lock_guard lock(mutex_);
    interrupted_ = true;
    for (Worker& w : workers_) w.queue.clear();
    for (StageQueue& q : queues_) {
      if (q.running) q.running->stop.request_stop();
    }
    changed_.notify_all();
  }

  bool over() const override {
    const std::lock_guard lock(mutex_);
    return interrupted_;
  }

 private:
  // Tasks of a stage; changed by the caller's thread only.
  struct StageQueue {
    std::deque<StageTask> waiting;
    // Started and not committed yet; its worker may not have begun it or have finished it. Changed with mutex_ held,
    // because interrupt() reads it.
    std::shared_ptr<Job> running;
  };

  StageQueue& queue(Stage stage) { return queues_[static_cast<std::size_t>(stage)]; }
  Worker& worker(Stage stage) { return workers_[static_cast<std::size_t>(stage)]; }

  int lag(const StageTask& task) const {
    if (setup_.options.await_calibration && setup_.functions[Stage::kCalibrate] && awaited(task, *gate_.newest()))
      return 0;
    switch (task.stage) {
      case Stage::kKeyframe:
        return setup_.options.lag_keyframe;
      case Stage::kMap:
        return setup_.options.lag_map;
      case Stage::kCalibrate:
        return setup_.options.lag_calibrate;
      case Stage::kLoop:
        return setup_.options.lag_loop;
      case Stage::kGlobal:
        return setup_.options.lag_global;
    }
    return 0;
  }

  void rethrow() const {
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
  }

  void fail(const std::exception_ptr& failure) {
    const std::lock_guard lock(mutex_);
    failure_ = failure;
  }

  // If the queue is full, its running task is committed early. This depends on counts only, so it is deterministic.
  void push(const StageTask& task) {
    StageQueue& q = queue(task.stage);
    if (q.waiting.size() >= static_cast<std::size_t>(setup_.options.max_pending_keyframes)) finish_running(task.stage);
    q.waiting.push_back(task);
    if (!q.running) start_next(task.stage);
  }

  void start_next(Stage stage) {
    StageQueue& q = queue(stage);
    if (q.waiting.empty()) return;
    auto job = std::make_shared<Job>();
    job->task = q.waiting.front();
    job->base = gate_.newest();
    job->started = now_;
    q.waiting.pop_front();
    const std::lock_guard lock(mutex_);
    if (interrupted_) return q.waiting.clear();
    q.running = job;
    worker(stage).queue.push_back(std::move(job));
    changed_.notify_all();
  }

  // Commits the results that are due at this frame, by stage. Returns false if none was: a task that a commit has
  // started may be due at once, also one of an earlier stage.
  bool finish_due() {
    bool any = false;
    for (const Stage stage : kStages) {
      const auto& running = queue(stage).running;
      for (; running && now_ >= running->started + lag(running->task); any = true) finish_running(stage);
    }
    return any;
  }

  // Waits for the running task of a stage and commits it. Then starts the tasks that follow and the next one of the
  // stage. A stopped task is only removed. It stays in the queue until then, so that interrupt() can still stop it.
  void finish_running(Stage stage) {
    const std::shared_ptr<Job> job = queue(stage).running;
    const CommitOutcome outcome = wait_for(*job) ? commit_result(*job) : CommitOutcome::kStopped;
    leave(stage);
    if (is_repeated(stage, outcome)) queue(stage).waiting.push_front(job->task);
    if (outcome == CommitOutcome::kCommitted) {
      for (const StageTask& next : following(job->task, *gate_.newest(), setup_.functions)) push(next);
    }
    start_next(stage);
  }

  // Returns false if interrupted before the job was done.
  bool wait_for(const Job& job) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return job.done || interrupted_; });
    return job.done;
  }

  // Commits the result of a job that is done, and reports it to the observer.
  CommitOutcome commit_result(Job& job) {
    const std::stop_token stop = job.stop.get_token();
    if (job.failure && !stop.stop_requested()) {  // failures of a stopped task are ignored
      fail(job.failure);
      rethrow();
    }
    const Superseded tasks = superseded_by(job.task.stage, job.result, *gate_.newest());
    for (const Stage s : tasks.dropped) queue(s).waiting.clear();
    for (const Stage s : tasks.dropped) stop_running(s);
    std::vector<StageTask> again;
    for (const Stage s : tasks.restarted) {
      if (const auto stopped = stop_running(s)) again.push_back(stopped->task);
    }
    const CommitOutcome outcome = gate_.commit_stage(job.task, job.base->version(), std::move(job.result), stop);
    if (!job.observed) observe(setup_, {job.task, job.ms, outcome == CommitOutcome::kCommitted});
    for (const StageTask& task : again) {
      queue(task.stage).waiting.push_front(task);
      start_next(task.stage);
    }
    return outcome;
  }

  // Removes the running task from its queue and returns it.
  std::shared_ptr<Job> leave(Stage stage) {
    const std::lock_guard lock(mutex_);
    return std::exchange(queue(stage).running, nullptr);
  }

  // Stops the running task of a stage and removes it from its queue; its result is never used. Returns null if none is
  // running.
  std::shared_ptr<Job> stop_running(Stage stage) {
    std::shared_ptr<Job> job = leave(stage);
    if (!job) return nullptr;
    {
      const std::lock_guard lock(mutex_);
      std::erase(worker(stage).queue, job);
      job->stop.request_stop();
      if (!job->done || job->observed) return job;  // its worker reports it
    }
    observe(setup_, {job->task, job->ms, false});
    return job;
  }

  // The functions below are called by a worker's thread.

  void work(Worker& w) {
    while (const std::shared_ptr<Job> job = take(w)) {
      const Stopwatch watch;
      try {
        job->result = setup_.functions[job->task.stage](job->task, job->base, job->stop.get_token());
      } catch (...) {
        job->failure = std::current_exception();
      }
      job->ms = watch.ms();
      if (!finish(*job)) continue;
      try {
        observe(setup_, {job->task, job->ms, false});
      } catch (...) {
        fail(std::current_exception());
      }
    }
  }

  // Returns whether the job was stopped; its worker then reports it to the observer.
  bool finish(Job& job) {
    const std::lock_guard lock(mutex_);
    job.done = true;
    job.observed = job.stop.stop_requested();
    changed_.notify_all();
    return job.observed;
  }

  // Returns the next job, or null if interrupted.
  std::shared_ptr<Job> take(Worker& w) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return interrupted_ || !w.queue.empty(); });
    if (interrupted_) return nullptr;
    std::shared_ptr<Job> job = std::move(w.queue.front());
    w.queue.pop_front();
    return job;
  }

  MapGate& gate_;
  const ExecutionSetup setup_;
  int now_ = 0;  // number of frames begun; this and the next member belong to the caller's thread
  std::array<StageQueue, kStages.size()> queues_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::exception_ptr failure_;  // guarded by mutex_, as the next member and the jobs of the workers
  bool interrupted_ = false;
  std::array<Worker, kStages.size()> workers_;  // last member, so that the threads are joined first
};

}  // namespace

std::unique_ptr<StageExecutor> make_lagged_executor(MapGate& gate, ExecutionSetup setup) {
  return std::make_unique<LaggedExecutor>(gate, std::move(setup));
}

}  // namespace bslam::execution
