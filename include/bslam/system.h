// The SLAM system: bundles of images in, poses and a map out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bslam/config.h"
#include "bslam/export.h"
#include "bslam/frame_result.h"
#include "bslam/image_bundle.h"
#include "bslam/map_view.h"
#include "bslam/result.h"
#include "bslam/rig.h"
#include "bslam/trajectory.h"

namespace bslam {

enum class LogLevel { kInfo, kWarning };

// Whether the images of a run agree with the calibration of its rig.
enum class CalibrationVerdict {
  kUnknown,      // not tested, or too few images to tell, or cameras that do not agree with each other at all
  kConsistent,   // they agree within the noise of the images
  kInconsistent  // they do not; unless calibration.refine is false, the map uses an estimate, MapView::rig()
};
BSLAM_EXPORT std::string_view to_string(CalibrationVerdict verdict);  // "unknown", "consistent", "inconsistent"

struct KeyframeEvent {
  int keyframe = -1;  // id in the map
  FrameResult frame;  // result of the frame that became the keyframe; it may be older than the last processed frame
};

// A place was recognised and the map corrected.
struct LoopEvent {
  int keyframe = -1, with = -1;                // ids of the two keyframes
  std::int64_t time_ns = 0, with_time_ns = 0;  // times of their frames
  int inliers = 0;                             // number of keypoints that support the loop closure
  bool submaps_merged = false;                 // the keyframes belonged to different submaps
};

// The state of a camera, or the reason of its state, has changed.
struct CameraEvent {
  std::size_t camera = 0;    // index in the rig
  std::int64_t time_ns = 0;  // time of the frame
  CameraResult before, now;
};

// Functions that a System calls to report events. Each may be empty. They are called by the thread that calls process()
// or finish() (or create(), see `log`), before that call returns; events of background threads are reported during the
// next of these calls. A callback may read the map, but must not call process(), finish() or trajectory(), which return
// an error then, and must not destroy the System. An exception thrown by a callback is caught, and the
// first one is returned as the error of the call, whose result is lost; every event is reported nevertheless, once, and
// the System remains usable.
struct Callbacks {
  std::function<void(const KeyframeEvent&)> keyframe;
  std::function<void(const LoopEvent&)> loop;
  std::function<void(const MapView&)> map;  // the map has changed since this callback was last called
  std::function<void(const CameraEvent&)> camera;
  // Receives log lines without line breaks; the library itself prints nothing. Also called by System::create().
  std::function<void(LogLevel, std::string_view line)> log;
};

// Optional input of a System in addition to rig and configuration.
struct Startup {
  std::filesystem::path map = {};         // saved map to continue after relocalising in it; empty: a new map
  std::filesystem::path vocabulary = {};  // bslam or DBoW2 text format; empty: the one within the library
  // False: no loop closing; a lost rig is only recovered near the place of loss, and the map is saved without visual
  // words, so that no rig can be found in it later. A map cannot be continued without place recognition.
  bool place_recognition = true;
  // Minimum number of latest frames that trajectory() returns. Older frames are discarded, so that memory grows with
  // the map only. 0: all frames are kept.
  std::size_t history_frames = 0;
  Callbacks callbacks = {};
};

// Owns the map and the threads. Only one thread at a time may call process(), finish() and trajectory(); a call during
// another one returns an error. map(), save_map(), calibration_verdict() and interrupt() may be called from any
// thread at any time. The destructor stops background work; no other call may be in progress then. A System that was
// moved from must not be used.
class BSLAM_EXPORT System {
 public:
  // Errors: inconsistent settings (localize_only without a map; calibration.refine=true without final_adjustment, with
  // localize_only, or in a map of another rig or calibration; a map without place recognition); a map or vocabulary
  // that cannot be read; a map that has no keyframes or was made with a different feature pyramid or vocabulary; an
  // exception of the callback `log`.
  static Result<System> create(const Rig& rig, const Config& config, Startup startup = {});
  System(System&& other) noexcept;
  System& operator=(System&& other) noexcept;
  ~System();

  // Estimates the pose of the rig for one bundle of images. Bundles must be in order of time. Pixels are only read
  // during the call, so the caller may reuse the memory afterwards. "Lost" is a result, not an error. Errors, which do
  // not change the state of the System: a number of images that differs from the number of cameras, no image, a size
  // that differs from the calibration, a stride smaller than the width, images more than a second apart, times that do
  // not increase, a call after finish(). An exception of a callback is returned after the frame was processed. An error
  // of a background thread ends the run and is returned by this and every later call.
  Result<FrameResult> process(const ImageBundle& images);

  // Waits for background work and, unless `final_adjustment` is off, adjusts the whole map. Must be called once, after
  // the last frame. Compares the images with the calibration, and logs a warning if they contradict it. Errors: a
  // second call; an error of a background thread.
  Status finish();

  // The verdict on the calibration; kUnknown before finish(), which logs how the estimate differs from it.
  CalibrationVerdict calibration_verdict() const;

  // Makes the current call and finish() return soon. Background work is stopped and its results are discarded from then
  // on: process() continues to track and to add keyframes, but no new landmarks are triangulated from several
  // keyframes, no loops are closed and nothing is adjusted.
  void interrupt();

  // Returns the current version of the map.
  MapView map() const;

  // Saves the current version of the map, for Startup::map and `bslam map`. The file is written completely or not at
  // all. It replaces an earlier map, and no other file. Errors: it cannot be written; the file is of another kind.
  Status save_map(const std::filesystem::path& file) const;

  // Return the poses of all frames that have one, corrected by the current map: trajectory() for the submap with the
  // most frames, trajectories() for all submaps, that one first. Error: a call during another call.
  Result<Trajectory> trajectory(RigFrame frame = RigFrame::kCamera0) const;
  Result<std::vector<Trajectory>> trajectories(RigFrame frame = RigFrame::kCamera0) const;

 private:
  struct Impl;
  explicit System(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// Returns the version of the library, such as "0.1.0".
BSLAM_EXPORT std::string_view version();

}  // namespace bslam
