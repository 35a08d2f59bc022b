// A queue between threads that rejects elements when it is full.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace bslam::map_service {

// All functions are thread-safe.
template <class T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t capacity) : capacity_(capacity) {}

  // Adds an element unless the queue is full or closed. Returns whether it was added; if not, `element` is unchanged.
  bool push(T&& element) {
    const std::lock_guard lock(mutex_);
    if (closed_ || elements_.size() >= capacity_) return false;
    elements_.push_back(std::move(element));
    not_empty_.notify_one();
    return true;
  }

  // Takes the oldest element, and waits for one. Returns nullopt once the queue is closed and empty.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    not_empty_.wait(lock, [this] { return closed_ || !elements_.empty(); });
    if (elements_.empty()) return std::nullopt;
    std::optional<T> element(std::move(elements_.front()));
    elements_.pop_front();
    return element;
  }

  // Closes the queue: no further elements are added.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    not_empty_.notify_all();
  }

  bool is_full() const {
    const std::lock_guard lock(mutex_);
    return closed_ || elements_.size() >= capacity_;
  }
  std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return elements_.size();
  }

 private:
  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable not_empty_;
  std::deque<T> elements_;  // guarded by mutex_, as closed_
  bool closed_ = false;
};

}  // namespace bslam::map_service
