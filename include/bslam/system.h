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

struct KeyframeEvent {
  int keyframe = -1;  // id in the map
  FrameResult frame;  // that became it
};

// A place was recognised and the map corrected.
struct LoopEvent {
  int keyframe = -1, with = -1;                // ids of the two keyframes
  std::int64_t time_ns = 0, with_time_ns = 0;  // of their frames
  int inliers = 0;                             // keypoints that support it
  bool submaps_merged = false;                 // the two belonged to different submaps
};

// A camera became ok, degraded or out, or is so for another reason.
struct CameraEvent {
  std::size_t camera = 0;    // in the rig
  std::int64_t time_ns = 0;  // of the frame
  CameraResult before, now;
};

// What a System tells while it works. Each may be empty. All are called by the thread that calls process() or finish()
// (or create(), see `log`), before that call returns; what a background thread found is told by the next of these
// calls. A callback may read the map, but a call of process(), finish() or trajectory() from within one is an error.
// What a callback throws is caught and returned as the error of the call, after which the System goes on.
struct Callbacks {
  std::function<void(const KeyframeEvent&)> keyframe;
  std::function<void(const LoopEvent&)> loop;
  std::function<void(const MapView&)> map;  // the map has another version than when this was last called
  std::function<void(const CameraEvent&)> camera;
  // `line` has no end of line; the library itself prints nothing. Called by System::create() as well.
  std::function<void(LogLevel, std::string_view line)> log;
};

// What a System may be given besides rig and configuration.
struct Startup {
  std::filesystem::path map = {};         // a saved map to go on in, once a place of it is recognised; empty: a new map
  std::filesystem::path vocabulary = {};  // for place recognition, bslam's or DBoW2's text; empty: the library's own
  bool place_recognition = true;          // false: no loops, and a lost rig is found again only where it was lost
  // Frames that trajectory() goes back, at least; older ones are forgotten, so that memory is bounded by the map. 0:
  // all since the start.
  std::size_t history_frames = 0;
  Callbacks callbacks = {};
};

// Owns the map and the threads. One thread at a time may call process(), finish() and trajectory(); a call while
// another one is under way is an error. map(), save_map() and interrupt() may be called from any thread at any time.
// Destruction stops what runs in the background.
class BSLAM_EXPORT System {
 public:
  // Errors: settings that contradict each other (localize_only without a map, extrinsics.refine without the adjustment
  // at the end); a map or vocabulary that cannot be read; a map without keyframes, of another rig, feature pyramid or
  // vocabulary.
  static Result<System> create(const Rig& rig, const Config& config, Startup startup = {});
  System(System&& other) noexcept;
  System& operator=(System&& other) noexcept;
  ~System();

  // The pose of the rig for one bundle of images; bundles come in order of time. Pixels are read during the call and
  // not copied as a whole, so the memory is free again when it returns. "Lost" is a result, not an error. Errors, which
  // leave the System as it was: another number of images than cameras, no image at all, sizes that are not the
  // calibration's, a stride below the width, images more than a second apart, times that are not later than those
  // before, a call after finish(). An error of a background thread ends the run: it is returned by this and every later
  // call.
  Result<FrameResult> process(const ImageBundle& images);

  // Waits for what runs in the background and, unless `final_adjustment` is off, adjusts the whole map. Call it once,
  // after the last frame. Errors: called before; one of a background thread.
  Status finish();

  // Makes the call under way, and finish(), return soon. Background work is stopped and left out from then on:
  // process() goes on to track and to add keyframes, but no landmarks are made between them, no loops closed, nothing
  // adjusted.
  void interrupt();

  // The present version of the map.
  MapView map() const;

  // Saves the present version of the map, for Startup::map and `bslam map`. The file appears whole or not at all.
  // Error: it cannot be written.
  Status save_map(const std::filesystem::path& file) const;

  // Every frame that has a pose, corrected by the present map; of the submap with the most frames, or of all of them,
  // that one first. Errors: called while another call is under way.
  Result<Trajectory> trajectory(RigFrame frame = RigFrame::kCamera0) const;
  Result<std::vector<Trajectory>> trajectories(RigFrame frame = RigFrame::kCamera0) const;

 private:
  struct Impl;
  explicit System(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// "0.1.0"
BSLAM_EXPORT std::string_view version();

}  // namespace bslam
