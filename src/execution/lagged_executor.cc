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

// One run of a stage. The worker fills in what it answers, then sets `done`.
struct Job {
  StageTask task;
  map::MapSnapshot base;
  int started = 0;  // frames begun until then
  std::stop_source stop;
  StageResult result;
  std::exception_ptr failure;
  double ms = 0;
  bool done = false;      // guarded by the executor's mutex, as the one below
  bool observed = false;  // by the worker, because the job was stopped before it was done
};

// What runs a lane's jobs, one after the other: it decides nothing.
struct Worker {
  std::deque<std::shared_ptr<Job>> handed;  // more than one only while a superseded one comes to its end
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
      const auto& running = lane(stage).running;
      if (running && now_ >= running->started + lag(stage)) settle(stage);
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
    for (const Stage stage : kStages) {  // a lane is fed by the one before it alone
      while (lane(stage).running) settle(stage);
    }
  }

  void restart() override {
    drain();
    gate_.restart();
  }

  void interrupt() override {
    const std::lock_guard lock(mutex_);
    interrupted_ = true;
    for (Worker& w : workers_) w.handed.clear();
    for (Lane& l : lanes_) {
      if (l.running) l.running->stop.request_stop();
    }
    changed_.notify_all();
  }

  bool over() const override {
    const std::lock_guard lock(mutex_);
    return interrupted_;
  }

 private:
  // The caller's view of a lane. Only the caller's thread changes it.
  struct Lane {
    std::deque<StageTask> waiting;
    // Begun and not settled yet, whether or not its worker is done with it. Changed with mutex_ held, because
    // interrupt() reads it.
    std::shared_ptr<Job> running;
  };

  Lane& lane(Stage stage) { return lanes_[static_cast<std::size_t>(stage)]; }
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
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
  }

  void fail(const std::exception_ptr& failure) {
    const std::lock_guard lock(mutex_);
    failure_ = failure;
  }

  // Whether a lane is full is a matter of counts: then its task under way is committed early.
  void push(const StageTask& task) {
    Lane& l = lane(task.stage);
    if (l.waiting.size() >= static_cast<std::size_t>(setup_.options.max_pending_keyframes)) settle(task.stage);
    l.waiting.push_back(task);
    if (!l.running) start_next(task.stage);
  }

  void start_next(Stage stage) {
    Lane& l = lane(stage);
    if (l.waiting.empty()) return;
    auto job = std::make_shared<Job>();
    job->task = l.waiting.front();
    job->base = gate_.newest();
    job->started = now_;
    l.waiting.pop_front();
    const std::lock_guard lock(mutex_);
    if (interrupted_) return l.waiting.clear();
    l.running = job;
    worker(stage).handed.push_back(std::move(job));
    changed_.notify_all();
  }

  // Waits for the lane's task under way and commits it, then what follows and the lane's next one start. A task that
  // was stopped is only removed. It stays in the lane until then, so that interrupt() can still stop it.
  void settle(Stage stage) {
    const std::shared_ptr<Job> job = lane(stage).running;
    const bool committed = wait_for(*job) && commit_result(*job);
    leave(stage);
    if (const auto next = following(job->task, setup_.functions); committed && next) push(*next);
    start_next(stage);
  }

  // Returns false if interrupted before the job was done.
  bool wait_for(const Job& job) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return job.done || interrupted_; });
    return job.done;
  }

  // Commits the result of a job that is done, and tells the observer.
  bool commit_result(Job& job) {
    const std::stop_token stop = job.stop.get_token();
    if (job.failure && !stop.stop_requested()) {  // what a stopped task ended with does not count
      fail(job.failure);
      rethrow();
    }
    if (const auto superseded = superseded_by(job.task.stage, job.result, *gate_.newest())) supersede(*superseded);
    const bool committed = gate_.settle(job.task, job.base->version(), std::move(job.result), stop);
    if (!job.observed) observe(setup_, {job.task, job.ms, committed});
    return committed;
  }

  // Removes the task under way from its lane and returns it.
  std::shared_ptr<Job> leave(Stage stage) {
    const std::lock_guard lock(mutex_);
    return std::exchange(lane(stage).running, nullptr);
  }

  // Drops what waits and stops what runs in a lane.
  void supersede(Stage stage) {
    lane(stage).waiting.clear();
    const std::shared_ptr<Job> job = leave(stage);
    if (!job) return;
    {
      const std::lock_guard lock(mutex_);
      std::erase(worker(stage).handed, job);
      job->stop.request_stop();
      if (!job->done || job->observed) return;  // its worker tells the observer
    }
    observe(setup_, {job->task, job->ms, false});
  }

  // The functions below: in a worker's thread.

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

  // Returns whether the job was stopped, so that nobody else tells the observer of it.
  bool finish(Job& job) {
    const std::lock_guard lock(mutex_);
    job.done = true;
    job.observed = job.stop.stop_requested();
    changed_.notify_all();
    return job.observed;
  }

  // The next job; none where interrupted.
  std::shared_ptr<Job> take(Worker& w) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return interrupted_ || !w.handed.empty(); });
    if (interrupted_) return nullptr;
    std::shared_ptr<Job> job = std::move(w.handed.front());
    w.handed.pop_front();
    return job;
  }

  MapGate& gate_;
  const ExecutionSetup setup_;
  int now_ = 0;  // frames begun; of the caller's thread, as the one below
  std::array<Lane, kStages.size()> lanes_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::exception_ptr failure_;  // guarded by mutex_, as the one below and what the workers are handed
  bool interrupted_ = false;
  std::array<Worker, kStages.size()> workers_;  // last: they end before the rest goes
};

}  // namespace

std::unique_ptr<StageExecutor> make_lagged_executor(MapGate& gate, ExecutionSetup setup) {
  return std::make_unique<LaggedExecutor>(gate, std::move(setup));
}

}  // namespace bslam::execution
