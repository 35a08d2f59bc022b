#include "session/frame_source.h"

#include <algorithm>
#include <utility>

#include "base/stopwatch.h"
#include "base/this_thread.h"

namespace bslam::session {

DatasetFrames::DatasetFrames(const dataset::Dataset& dataset, std::size_t ahead, ReaderPriority priority,
                             std::function<bool(TimeNs, TimeNs)> skips)
    : dataset_(dataset), ahead_(ahead), skips_(std::move(skips)), reader_([this, priority](std::stop_token stop) {
        if (priority == ReaderPriority::kLow) lower_thread_priority();
        read(std::move(stop));
      }) {}

std::optional<FrameSource::Item> DatasetFrames::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !ready_.empty() || finished_; });
  if (ready_.empty()) {
    if (failure_) std::rethrow_exception(failure_);
    return std::nullopt;
  }
  Item item = std::move(ready_.front());
  ready_.pop_front();
  bytes_ -= item.images.memory_bytes();
  item.waiting = static_cast<std::size_t>(std::ranges::count(ready_, false, &Item::dropped));
  changed_.notify_all();
  return item;
}

std::size_t DatasetFrames::largest_bytes() const {
  const std::lock_guard lock(mutex_);
  return largest_bytes_;
}

FrameSource::Item DatasetFrames::read_item(std::size_t index) const {
  const Stopwatch watch;
  Item item;
  item.images.id = FrameId(index);
  item.images.time_ns = dataset_.frames[index].time_ns;
  if (index + 1 < dataset_.frames.size()) item.next_ns = dataset_.frames[index + 1].time_ns;
  item.dropped = skips_ && item.next_ns && skips_(item.images.time_ns, *item.next_ns);
  if (!item.dropped) item.images = dataset::read_frame(dataset_, index);
  item.read_ms = watch.ms();
  return item;
}

void DatasetFrames::read(std::stop_token stop) {
  std::exception_ptr failure;
  try {
    for (std::size_t i = 0; i < dataset_.frames.size() && !stop.stop_requested(); ++i) {
      Item item = read_item(i);
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [this] { return ready_.size() < ahead_; })) break;
      bytes_ += item.images.memory_bytes();
      largest_bytes_ = std::max(largest_bytes_, bytes_);
      ready_.push_back(std::move(item));
      changed_.notify_all();
    }
  } catch (...) {
    failure = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  finished_ = true;
  failure_ = failure;
  changed_.notify_all();
}

}  // namespace bslam::session
