#include "base/thread_pool.h"

#include <utility>

#include "base/assert.h"

namespace bslam {

ThreadPool::ThreadPool(int threads) {
  BSLAM_ASSERT(threads >= 1, "the number of threads must be 1 or more");
  for (int i = 1; i < threads; ++i) workers_.emplace_back([this](std::stop_token stop) { work(std::move(stop)); });
}

ThreadPool::~ThreadPool() {
  for (std::jthread& worker : workers_) worker.request_stop();
  wake_.notify_all();
}

void ThreadPool::for_each(std::size_t count, const std::function<void(std::size_t)>& body) {
  if (workers_.empty() || count <= 1) {
    std::exception_ptr failure;
    for (std::size_t i = 0; i < count; ++i) {
      try {
        body(i);
      } catch (...) {
        if (!failure) failure = std::current_exception();
      }
    }
    if (failure) std::rethrow_exception(failure);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    BSLAM_ASSERT(body_ == nullptr, "only one loop may run at a time");
    body_ = &body;
    next_ = 0;
    count_ = count;
  }
  wake_.notify_all();
  drain();
  std::unique_lock lock(mutex_);
  done_.wait(lock, [this] { return next_ >= count_ && running_ == 0; });
  body_ = nullptr;
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void ThreadPool::work(std::stop_token stop) {
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      if (!wake_.wait(lock, stop, [this] { return body_ != nullptr && next_ < count_; })) return;
    }
    drain();
  }
}

void ThreadPool::drain() {
  std::unique_lock lock(mutex_);
  while (body_ != nullptr && next_ < count_) {
    const std::size_t item = next_++;
    const auto* body = body_;
    ++running_;
    lock.unlock();
    std::exception_ptr failure;
    try {
      (*body)(item);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    if (failure && !failure_) failure_ = failure;
    if (--running_ == 0 && next_ >= count_) done_.notify_all();
  }
}

}  // namespace bslam
