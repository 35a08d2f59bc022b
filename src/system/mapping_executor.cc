#include "system/mapping_executor.h"

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>

#include "mapping/map_keyframe.h"
#include "system/stopwatch.h"

namespace bslam::system {
namespace {

// One run of the mapping stage, from the newest version to its commit.
void run_mapping(KeyframeId keyframe, map::MapStore& store, const Config& config, const MappingObserver& observer,
                 std::stop_token stop) {
  const Stopwatch watch;
  const map::MapSnapshot snapshot = store.snapshot();
  if (!snapshot->alive(keyframe)) return;
  map::MapDraft draft("map", snapshot);
  mapping::map_keyframe(keyframe, config.mapping, config.feature_model(), draft, std::move(stop));
  store.commit(std::move(draft));
  if (observer) observer(keyframe, watch.ms());
}

class SequentialMapping : public MappingExecutor {
 public:
  SequentialMapping(map::MapStore& store, const Config& config, MappingObserver observer)
      : store_(store), config_(config), observer_(std::move(observer)) {}

  void enqueue(KeyframeId keyframe) override { run_mapping(keyframe, store_, config_, observer_, {}); }
  void drain() override {}

 private:
  map::MapStore& store_;
  const Config& config_;
  MappingObserver observer_;
};

class ParallelMapping : public MappingExecutor {
 public:
  ParallelMapping(map::MapStore& store, const Config& config, MappingObserver observer)
      : store_(store), config_(config), observer_(std::move(observer)),
        worker_([this](std::stop_token stop) { work(std::move(stop)); }) {}

  void enqueue(KeyframeId keyframe) override {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return failure_ || pending_.size() < static_cast<std::size_t>(config_.execution.pending_keyframes); });
    rethrow();
    pending_.push_back(keyframe);
    changed_.notify_all();
  }

  void drain() override {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return failure_ || (pending_.empty() && !busy_); });
    rethrow();
  }

 private:
  void rethrow() {
    if (failure_) std::rethrow_exception(failure_);
  }

  void work(std::stop_token stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [this] { return !pending_.empty(); })) {
      const KeyframeId keyframe = pending_.front();
      pending_.pop_front();
      busy_ = true;
      lock.unlock();
      changed_.notify_all();
      std::exception_ptr failure;
      try {
        run_mapping(keyframe, store_, config_, observer_, stop);
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      busy_ = false;
      if (failure) failure_ = failure;
      changed_.notify_all();
      if (failure_) return;
    }
  }

  map::MapStore& store_;
  const Config& config_;
  MappingObserver observer_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<KeyframeId> pending_;  // guarded by mutex_, as the two below
  bool busy_ = false;
  std::exception_ptr failure_;
  std::jthread worker_;  // last: stops before the rest goes
};

}  // namespace

std::unique_ptr<MappingExecutor> make_mapping_executor(map::MapStore& store, const Config& config, MappingObserver observer) {
  if (config.mode == Mode::kSequential) return std::make_unique<SequentialMapping>(store, config, std::move(observer));
  return std::make_unique<ParallelMapping>(store, config, std::move(observer));
}

}  // namespace bslam::system
