// Frames of a data set, read ahead by a thread of its own, in order.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "dataset/frame_reader.h"

namespace bslam::session {

// Does reading ahead give way to the threads that work on the frame in hand? Where stages run beside these it must not:
// they would starve it.
enum class ReadAhead { kAsAll, kGivesWay };

class FrameSource {
 public:
  struct Item {
    image::ImageBundle images;
    double read_ms = 0;  // reading and decoding
  };

  // Borrows `dataset`; keeps at most `ahead` frames read and not yet taken.
  FrameSource(const dataset::Dataset& dataset, std::size_t ahead, ReadAhead priority = ReadAhead::kAsAll);
  ~FrameSource() = default;

  // The next frame; empty after the last. Throws what the reading thread threw.
  std::optional<Item> next();

 private:
  void read(std::stop_token stop);

  const dataset::Dataset& dataset_;
  const std::size_t ahead_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Item> ready_;  // guarded by mutex_, as the two below
  bool finished_ = false;
  std::exception_ptr failure_;
  std::jthread reader_;  // last: stops before the rest goes
};

}  // namespace bslam::session
