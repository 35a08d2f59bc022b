// Records the frames of a live run in an MCAP file, in a thread of its own. `bslam run` of the file gets the same
// frames.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "capture/live_frame.h"
#include "containers/mcap_writer.h"

namespace bslam::capture {

// Returns the rig as it is read back from a recording, with the paths of its own masks. Rotations of other formats than
// that of bslam may differ in their last bits. A run that is to be repeated exactly must use it.
Result<camera::Rig> rig_as_recorded(const camera::Rig& rig);

class Recorder {
 public:
  // `numbers`: indices in the rig file of the cameras of `rig`. `jpeg[i]`: camera i delivers JPEG files, which are
  // recorded as they are; other images are recorded as grey values. Errors: the file cannot be written; a mask cannot
  // be read.
  static Result<std::unique_ptr<Recorder>> create(const std::filesystem::path& path, const camera::Rig& rig,
                                                  const std::vector<int>& numbers, const std::vector<bool>& jpeg);
  ~Recorder();  // calls finish()
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // Adds a frame. Waits while many frames are still to be written; returns false if `stop` was requested before there
  // was room. After an error frames are not recorded any more.
  bool add(const ImageBundle& frame, const std::stop_token& stop = {});

  // Writes what is left and ends the file. To be called from one thread. Error: it could not be written completely.
  Status finish();

  // Amount of data written; final after finish().
  std::size_t frames() const;
  std::uint64_t bytes() const;

 private:
  Recorder(std::filesystem::path path, std::unique_ptr<containers::McapWriter> file, const camera::Rig& rig);
  void run();
  void write_frames();
  Status write(const ImageBundle& frame);

  const std::filesystem::path path_;
  const camera::Rig rig_;
  const std::unique_ptr<containers::McapWriter> file_;  // used by the thread only, until it has ended
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<ImageBundle> waiting_;  // guarded by mutex_, like all until `thread_`
  bool ending_ = false;
  Status status_;
  std::size_t frames_ = 0;
  std::uint64_t bytes_ = 0;
  std::thread thread_;
};

}  // namespace bslam::capture
