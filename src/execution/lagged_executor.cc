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
  bool done = false;  // guarded by the executor's mutex
};

// What runs a lane's jobs, one after the other: it decides nothing.
struct Worker {
  std::deque<std::shared_ptr<Job>> handed;  // more than one only while a superseded one comes to its end
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

  void restart(map::BundledMap initial) override {
    drain();
    gate_.restart(std::move(initial));
  }

  void interrupt() override {
    const std::lock_guard lock(mutex_);
    interrupted_ = true;
    for (Worker& w : workers_) {
      w.handed.clear();
      if (w.running) w.running->stop.request_stop();
    }
    changed_.notify_all();
  }

  bool over() const override {
    const std::lock_guard lock(mutex_);
    return interrupted_;
  }

 private:
  // The caller's view of a lane; its thread alone looks at it.
  struct Lane {
    std::deque<StageTask> waiting;
    std::shared_ptr<Job> running;  // begun and not committed yet, whether its worker is there or not
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
    if (failure_) std::rethrow_exception(failure_);
  }

  // Whether a lane is full is a matter of counts: then its task under way is committed early.
  void push(const StageTask& task) {
    Lane& l = lane(task.stage);
    if (l.waiting.size() >= static_cast<std::size_t>(setup_.options.pending_keyframes)) settle(task.stage);
    l.waiting.push_back(task);
    if (!l.running) start_next(task.stage);
  }

  void start_next(Stage stage) {
    Lane& l = lane(stage);
    if (l.waiting.empty()) return;
    l.running = std::make_shared<Job>();
    l.running->task = l.waiting.front();
    l.running->base = gate_.newest();
    l.running->started = now_;
    l.waiting.pop_front();
    const std::lock_guard lock(mutex_);
    if (interrupted_) return;  // nobody will do it, and nobody will wait for it
    worker(stage).handed.push_back(l.running);
    changed_.notify_all();
  }

  // Waits for the lane's task under way and commits it, then what follows and the lane's next one start.
  void settle(Stage stage) {
    Lane& l = lane(stage);
    const std::shared_ptr<Job> job = std::exchange(l.running, nullptr);
    if (!wait_for(*job)) {
      l.waiting.clear();
      return;
    }
    if (job->failure) {
      failure_ = job->failure;
      rethrow();
    }
    if (const auto superseded = superseded_by(stage, job->result, *gate_.newest())) supersede(*superseded);
    std::vector<StageStatistic> statistics = std::move(job->result.statistics);
    const bool committed = gate_.settle(job->task, job->base->version(), std::move(job->result), job->stop.get_token());
    observe(setup_, {job->task, job->ms, committed, std::move(statistics)});
    if (const auto next = following(job->task, setup_.functions); committed && next) push(*next);
    start_next(stage);
  }

  // False where interrupted before it was done.
  bool wait_for(const Job& job) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return job.done || interrupted_; });
    return job.done;
  }

  // Drops what waits and stops what runs in a lane.
  void supersede(Stage stage) {
    Lane& l = lane(stage);
    l.waiting.clear();
    const std::shared_ptr<Job> job = std::exchange(l.running, nullptr);
    if (!job) return;
    const std::lock_guard lock(mutex_);
    std::erase(worker(stage).handed, job);
    job->stop.request_stop();
    if (job->done) observe(setup_, {job->task, job->ms, false});  // else its worker tells
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

  // The next job; none where interrupted.
  std::shared_ptr<Job> take(Worker& w) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return interrupted_ || !w.handed.empty(); });
    if (interrupted_) return nullptr;
    w.running = std::move(w.handed.front());
    w.handed.pop_front();
    return w.running;
  }

  MapGate& gate_;
  const ExecutionSetup setup_;
  int now_ = 0;  // frames begun; of the caller's thread, as the two below
  std::array<Lane, kStages.size()> lanes_;
  std::exception_ptr failure_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool interrupted_ = false;                    // guarded by mutex_, as what the workers are handed and run
  std::array<Worker, kStages.size()> workers_;  // last: they end before the rest goes
};

}  // namespace

std::unique_ptr<StageExecutor> make_lagged_executor(MapGate& gate, ExecutionSetup setup) {
  return std::make_unique<LaggedExecutor>(gate, std::move(setup));
}

}  // namespace bslam::execution
