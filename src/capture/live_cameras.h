// The cameras of a rig as the source of a run: a thread for each camera, whose images are grouped into frames by
// bslam::Synchronizer. Frames wait until they are asked for; if too many wait, the oldest are dropped.
#pragma once

#include <bslam/synchronizer.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "camera/rig.h"
#include "capture/device.h"
#include "capture/live_frame.h"
#include "capture/recorder.h"
#include "session/frame_source.h"

namespace bslam::capture {

struct LiveOptions {
  std::vector<std::string> paths;  // one per camera of the rig
  StreamRequest request;           // its resolution is that of the rig
  OpenDevice open;
  double sync_tolerance_s = 0.002;
  // Frames that may wait, also if they span a longer time, and the time that they may span, also if they are more.
  std::size_t max_waiting = 3;
  std::chrono::milliseconds max_span{100};
  // A camera is opened again if it delivers no image for so long, and for three of its intervals.
  std::chrono::milliseconds silence{2000};
  std::chrono::milliseconds retry{1000};         // between attempts to open a lost camera
  std::chrono::milliseconds first_image{10000};  // how long is waited for the first images, or three intervals
  // Called with lines for the user, such as that a camera was unplugged; by one thread at a time. May be empty.
  std::function<void(const std::string& line)> say = {};
};

class LiveCameras final : public session::FrameSource {
 public:
  // Opens and starts all cameras. Errors: those of Device::start and OpenDevice, with the name of the camera.
  static Result<std::unique_ptr<LiveCameras>> open(const camera::Rig& rig, LiveOptions options);
  ~LiveCameras() override;

  // The settings that each camera has accepted.
  std::vector<Stream> streams() const;

  // Waits until every camera has delivered an image, and returns the time of the first frame. Errors: a camera was lost
  // or delivered none; stop() was called.
  Result<TimeNs> wait_for_first_frame();

  // Frames are recorded from now on as they are handed out. `recorder` must outlive the last call of next().
  void record_to(Recorder* recorder) { recorder_ = recorder; }

  // Begins the run: frames that came before are not part of it. Called once, before next().
  void begin();

  // Waits for the frame that next() returns, and returns its time; nullopt if there is none.
  std::optional<TimeNs> wait_for_frame();

  // Returns nullopt after stop(), or when all cameras have ended, once the frames before were handed out. Rethrows
  // exceptions of the threads.
  std::optional<Item> next() override;

  // Ends the capture; may be called from any thread.
  void stop();

  // Messages for the user at the end of the run: per camera, the number of damaged or unusable images, and how often
  // the camera was lost.
  std::vector<std::string> notes() const;

 private:
  struct CameraState {
    std::string path;
    StreamRequest request;
    Stream stream;                   // written by the thread of the camera, with mutex_
    std::unique_ptr<Device> device;  // used by the thread of the camera only, like the next one
    std::string other_camera;        // the identity of another camera that was found in its place
    // Guarded by mutex_.
    std::size_t images = 0, damaged = 0, losses = 0;
    bool lost = false, unstamped = false;
    std::string why_lost;
    std::array<bool, kDropReasons> drop_said{};
    std::size_t late_under_load = 0;  // images that came too late while frames waited for the tracker
  };
  struct Waiting {
    ImageBundle bundle;
    TimeNs time_ns = 0;
    bool dropped = false;
  };

  LiveCameras(const camera::Rig& rig, LiveOptions options);
  void run(std::size_t camera, const std::stop_token& stop);
  void capture(std::size_t camera, const std::stop_token& stop);
  void take(std::size_t camera, const DeviceImage& image);
  void count_damaged(std::size_t camera);
  void collect();
  void lose(std::size_t camera, const std::string& why);
  bool reopen(std::size_t camera, const std::stop_token& stop);
  Error no_images() const;
  void note_drop(const DroppedImage& image);
  void say(std::size_t camera, const std::string& text);
  std::string name_of(std::size_t camera) const;

  const camera::Rig rig_;
  const LiveOptions options_;
  Recorder* recorder_ = nullptr;
  std::stop_source stop_recording_;
  std::optional<Synchronizer> synchronizer_;
  std::vector<CameraState> cameras_;

  std::mutex say_mutex_;
  mutable std::mutex mutex_;  // guards all members until `threads_`, and the members of CameraState that say so
  std::condition_variable_any changed_;
  std::deque<Waiting> waiting_;
  std::size_t frames_waiting_ = 0;  // waiting frames that were not dropped
  bool overloaded_ = false;         // the queue of frames has been full and is not empty yet
  bool begun_ = false, ended_ = false, stopped_ = false;
  std::size_t running_ = 0;  // threads
  std::exception_ptr failure_;
  std::uint64_t handed_out_ = 0;
  std::vector<std::jthread> threads_;
};

}  // namespace bslam::capture
