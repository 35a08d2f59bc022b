// One frame through the caller's thread: monitor the cameras, extract, bundle, track, commit. Policy is that of the
// tracker (tracking/tracker.h); background stages are those of the executor.
#pragma once

#include <memory>

#include "base/thread_pool.h"
#include "execution/stage_executor.h"
#include "matching/frame_builder.h"
#include "system/config.h"
#include "tracking/tracker.h"

namespace bslam::system {

using tracking::FrameRecord;
using tracking::Relocalisation;
using tracking::StageTime;

class Pipeline {
 public:
  // `rig` and `config` outlive it. Without a relocaliser a lost rig is searched for only where it was lost.
  Pipeline(const camera::Rig& rig, const Config& config, std::vector<image::Image> masks,
           std::unique_ptr<tracking::Relocaliser> relocaliser = nullptr);

  struct Outcome {
    FrameRecord record;
    map::MapSnapshot seen;              // version of the map the frame was tracked in
    std::vector<KeyframeId> keyframes;  // added to the map, in order: the background stages are due for them
    bool started_submap = false;        // the first of them is the root of a new submap
    std::vector<tracking::BetweenKeyframes> early;  // frames a start up to scale was made from, the first among them
  };

  // Reads the version of the map that `executor` gives the frame, and commits keyframes through it. `images`: one per
  // camera of the rig.
  Outcome process(const image::ImageBundle& images, execution::StageExecutor& executor);

  // Extraction and bundling of a frame by itself.
  frame::BundledFrame make_frame(const image::ImageBundle& images);

  // Forgets the map that was tracked; the next frames start another.
  void restart() { state_ = state_.restarted(); }

  tracking::TrackStatus status() const { return state_.track.status; }
  const tracking::Tracker& tracker() const { return tracker_; }

 private:
  frame::BundledFrame extract(const image::ImageBundle& images, const tracking::FramePlan& plan);
  frame::BundledFrame bundle(const tracking::FramePlan& plan, const frame::BundledFrame& frame);
  void commit(tracking::TrackOutcome& tracked, execution::StageExecutor& executor, Outcome& outcome);

  const camera::Rig& rig_;
  const Config& config_;
  ThreadPool pool_;
  tracking::CameraMonitor monitor_;
  tracking::CameraStatusMonitor status_;
  matching::FrameBuilder builder_;
  tracking::Tracker tracker_;
  tracking::FrontEndState state_;
};

}  // namespace bslam::system
