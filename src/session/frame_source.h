// Reads the frames of a data set ahead of time, in order, in a separate thread.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "dataset/frame_reader.h"

namespace bslam::session {

// Priority of the reading thread: the same as the other threads, or lower. The lower priority is for sequential runs
// only; with background stages, a reader with lower priority would get too little processor time.
enum class ReaderPriority { kNormal, kLow };

class FrameSource {
 public:
  struct Item {
    image::ImageBundle images;
    double read_ms = 0;  // time for reading and decoding
  };

  // Keeps a reference to `dataset`, which must outlive this object. Up to `ahead` frames are read in advance.
  FrameSource(const dataset::Dataset& dataset, std::size_t ahead, ReaderPriority priority = ReaderPriority::kNormal);
  ~FrameSource() = default;

  // Returns the next frame, or nullopt after the last one. Rethrows exceptions of the reading thread.
  std::optional<Item> next();

 private:
  void read(std::stop_token stop);

  const dataset::Dataset& dataset_;
  const std::size_t ahead_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Item> ready_;  // guarded by mutex_, like the next two members
  bool finished_ = false;
  std::exception_ptr failure_;
  std::jthread reader_;  // declared last, so that it stops before the other members are destroyed
};

}  // namespace bslam::session
