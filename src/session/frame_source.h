// The source of the frames of a run: a data set, whose frames are read ahead of time, or live cameras.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "dataset/frame_reader.h"

namespace bslam::session {

class FrameSource {
 public:
  struct Item {
    image::ImageBundle images;  // without images if the frame was dropped
    double read_ms = 0;         // time for reading and decoding
    // Time of the next frame, used to detect that this one is late; nullopt if there is none or it is unknown.
    std::optional<TimeNs> next_ns = {};
    bool dropped = false;     // the source had no room for it, because processing was too slow
    std::size_t waiting = 0;  // frames that wait behind it
    double waiting_s = 0;     // of a live source: time from this frame to the newest one that waits
  };

  FrameSource() = default;
  virtual ~FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;

  // Waits for the next frame. Frames come in order of time; those that were not dropped are numbered from 0. Returns
  // nullopt after the last one.
  virtual std::optional<Item> next() = 0;

  // Maximum memory of the frames read in advance so far, in bytes.
  virtual std::size_t largest_bytes() const { return 0; }
};

// Priority of the reading thread: the same as the other threads, or lower. The lower priority is for sequential runs
// only; with background stages, a reader with lower priority would get too little processor time.
enum class ReaderPriority { kNormal, kLow };

// The frames of a data set, read in a separate thread.
class DatasetFrames final : public FrameSource {
 public:
  // Keeps a reference to `dataset`, which must outlive this object. Up to `ahead` frames are read in advance.
  // `skips`: called by the reading thread with the times of a frame that is to be read next and of the one after it; if
  // it returns true, the frame is dropped without being read. Not called for the last frame. May be empty.
  DatasetFrames(const dataset::Dataset& dataset, std::size_t ahead, ReaderPriority priority = ReaderPriority::kNormal,
                std::function<bool(TimeNs, TimeNs)> skips = {});

  // Rethrows exceptions of the reading thread.
  std::optional<Item> next() override;
  std::size_t largest_bytes() const override;

 private:
  void read(std::stop_token stop);
  Item read_item(std::size_t index) const;

  const dataset::Dataset& dataset_;
  const std::size_t ahead_;
  const std::function<bool(TimeNs, TimeNs)> skips_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Item> ready_;                     // guarded by mutex_, like the next four members
  std::size_t bytes_ = 0, largest_bytes_ = 0;  // memory of the images in `ready_`, now and at most
  bool finished_ = false;
  std::exception_ptr failure_;
  std::jthread reader_;  // declared last, so that it stops before the other members are destroyed
};

}  // namespace bslam::session
