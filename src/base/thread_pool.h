// Data parallelism with results in fixed slots: which thread does which item never changes a result.
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
  // `threads` threads work on a loop, the caller among them; 1 means the caller alone.
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int size() const { return static_cast<int>(workers_.size()) + 1; }

  // Calls body(i) once for every i in [0, count) and returns when all are done, also where some throw. `body` writes
  // only to slots of its own index. The first exception thrown is rethrown here. One loop at a time; not to be called
  // from within `body`.
  void for_each(std::size_t count, const std::function<void(std::size_t)>& body);

 private:
  void work(std::stop_token stop);
  void drain();

  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::condition_variable done_;
  const std::function<void(std::size_t)>* body_ = nullptr;  // guarded by mutex_, as all below
  std::size_t next_ = 0, count_ = 0, running_ = 0;
  std::exception_ptr failure_;
  std::vector<std::jthread> workers_;
};

}  // namespace bslam
