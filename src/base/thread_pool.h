// Data-parallel loops. Each item writes only its own output, so the result does not depend on which thread runs which
// item.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace bslam {

class ThreadPool {
 public:
  // `threads` is the number of threads that run a loop, including the caller; if it is 1, only the caller runs it.
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int size() const { return static_cast<int>(workers_.size()) + 1; }

  // Calls body(i) exactly once for every i in [0, count) and returns when all calls have finished, even if some of them
  // throw. `body` must only write to data that belongs to its own index. The first exception is rethrown. Only one loop
  // may run at a time, and `body` must not call for_each.
  void for_each(std::size_t count, const std::function<void(std::size_t)>& body);

 private:
  void work(std::stop_token stop);
  void drain();

  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::condition_variable done_;
  const std::function<void(std::size_t)>* body_ = nullptr;  // guarded by mutex_, like all members below
  std::size_t next_ = 0, count_ = 0, running_ = 0;
  std::exception_ptr failure_;
  std::vector<std::jthread> workers_;
};

}  // namespace bslam
