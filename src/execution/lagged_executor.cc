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
  bool done = false;  // guarded by the executor's mutex
};

// Runs the jobs of a stage one after the other.
struct Worker {
  std::deque<std::shared_ptr<Job>> queue;  // at most one job, which waits if a superseded one is still running
  std::shared_ptr<Job> running;
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

  map::MapSnapshot begin_frame(FrameId frame) override {
    rethrow();
    ++now_;
    for (const Stage stage : kStages) {
      const auto& running = queue(stage).running;
      if (running && now_ >= running->started + lag(stage)) finish_running(stage);
    }
    return gate_.begin_frame(frame);
  }

  map::CommitReport commit(JournalStep step, map::MapDraft draft) override {
    rethrow();
    return gate_.commit(step, std::move(draft));
  }

  void enqueue(KeyframeId keyframe) override {
    rethrow();
    push({Stage::kMap, keyframe});
  }

  void drain() override {
    rethrow();
    for (const Stage stage : kStages) {  // a stage only creates tasks of later stages
      while (queue(stage).running) finish_running(stage);
    }
  }

  void restart(map::BundledMap initial) override {
    drain();
    gate_.restart(std::move(initial));
  }

  void interrupt() override {
    const std::lock_guard lock(mutex_);
    interrupted_ = true;
    for (Worker& w : workers_) {
      w.queue.clear();
      if (w.running) w.running->stop.request_stop();
    }
    changed_.notify_all();
  }

  bool over() const override {
    const std::lock_guard lock(mutex_);
    return interrupted_;
  }

 private:
  // Tasks of a stage; used by the caller's thread only.
  struct StageQueue {
    std::deque<StageTask> waiting;
    std::shared_ptr<Job>
        running;  // started and not committed yet; its worker may not have begun it or have finished it
  };

  StageQueue& queue(Stage stage) { return queues_[static_cast<std::size_t>(stage)]; }
  Worker& worker(Stage stage) { return workers_[static_cast<std::size_t>(stage)]; }

  int lag(Stage stage) const {
    switch (stage) {
      case Stage::kMap:
        return setup_.options.lag_map;
      case Stage::kLoop:
        return setup_.options.lag_loop;
      case Stage::kGlobal:
        return setup_.options.lag_global;
    }
    return 0;
  }

  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
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
    q.running = std::make_shared<Job>();
    q.running->task = q.waiting.front();
    q.running->base = gate_.newest();
    q.running->started = now_;
    q.waiting.pop_front();
    const std::lock_guard lock(mutex_);
    if (interrupted_) return;  // no worker will run it, and wait_for() does not wait
    worker(stage).queue.push_back(q.running);
    changed_.notify_all();
  }

  // Waits for the running task of a stage and commits it. Then starts the task that follows and the next one of the
  // stage.
  void finish_running(Stage stage) {
    StageQueue& q = queue(stage);
    const std::shared_ptr<Job> job = std::exchange(q.running, nullptr);
    if (!wait_for(*job)) {
      q.waiting.clear();
      return;
    }
    if (job->failure) {
      failure_ = job->failure;
      rethrow();
    }
    if (const auto superseded = superseded_by(stage, job->result, *gate_.newest())) supersede(*superseded);
    std::vector<StageStatistic> statistics = std::move(job->result.statistics);
    const bool committed =
        gate_.commit_stage(job->task, job->base->version(), std::move(job->result), job->stop.get_token());
    observe(setup_, {job->task, job->ms, committed, std::move(statistics)});
    if (const auto next = following(job->task, setup_.functions); committed && next) push(*next);
    start_next(stage);
  }

  // Returns false if interrupted before the job was done.
  bool wait_for(const Job& job) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return job.done || interrupted_; });
    return job.done;
  }

  // Drops the waiting tasks of a stage and stops its running one.
  void supersede(Stage stage) {
    StageQueue& q = queue(stage);
    q.waiting.clear();
    const std::shared_ptr<Job> job = std::exchange(q.running, nullptr);
    if (!job) return;
    const std::lock_guard lock(mutex_);
    std::erase(worker(stage).queue, job);
    job->stop.request_stop();
    if (job->done) observe(setup_, {job->task, job->ms, false});  // else its worker reports it
  }

  void work(Worker& w) {
    while (const std::shared_ptr<Job> job = take(w)) {
      const Stopwatch watch;
      try {
        job->result = setup_.functions[job->task.stage](job->task, job->base, job->stop.get_token());
      } catch (...) {
        job->failure = std::current_exception();
      }
      job->ms = watch.ms();
      const std::lock_guard lock(mutex_);
      w.running.reset();
      job->done = true;
      if (job->stop.stop_requested()) observe(setup_, {job->task, job->ms, false});
      changed_.notify_all();
    }
  }

  // Returns the next job, or null if interrupted.
  std::shared_ptr<Job> take(Worker& w) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return interrupted_ || !w.queue.empty(); });
    if (interrupted_) return nullptr;
    w.running = std::move(w.queue.front());
    w.queue.pop_front();
    return w.running;
  }

  MapGate& gate_;
  const ExecutionSetup setup_;
  int now_ = 0;  // number of frames begun; this and the next two members belong to the caller's thread
  std::array<StageQueue, kStages.size()> queues_;
  std::exception_ptr failure_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool interrupted_ = false;                    // guarded by mutex_, as the jobs of the workers
  std::array<Worker, kStages.size()> workers_;  // last member, so that the threads are joined first
};

}  // namespace

std::unique_ptr<StageExecutor> make_lagged_executor(MapGate& gate, ExecutionSetup setup) {
  return std::make_unique<LaggedExecutor>(gate, std::move(setup));
}

}  // namespace bslam::execution
