// Processing of a frame in the caller's thread: camera monitoring, pyramids, direct tracking or extraction, bundling
// and tracking, commit. Decisions are made by the tracker (tracking/tracker.h); background stages are run by the
// executor.
#pragma once

#include <memory>

#include "base/thread_pool.h"
#include "execution/stage_executor.h"
#include "system/config.h"
#include "system/frame_preparation.h"
#include "system/keyframe_maker.h"
#include "tracking/tracker.h"

namespace bslam::system {

using tracking::FrameRecord;
using tracking::Relocalisation;
using tracking::StageTime;

class Pipeline {
 public:
  // `rig`, `config` and `keyframe_maker` must outlive the pipeline. Without a relocaliser a lost rig is only searched
  // for near its last pose. `cameras`: the cameras of the rig that are used in this run. `keyframe_maker`: may be null
  // if the map is not changed (Config::localize_only).
  Pipeline(const camera::Rig& rig, CamerasOfRun cameras, const Config& config, std::vector<image::Image> masks,
           std::unique_ptr<tracking::Relocaliser> relocaliser, KeyframeMaker* keyframe_maker);

  struct AddedKeyframe {
    KeyframeId id;
    TimeNs time_ns = 0;  // of its frame, which is an earlier one for the first keyframe of a monocular initialisation
  };

  struct Outcome {
    FrameRecord record;
    map::MapSnapshot seen;  // version of the map the frame was tracked in
    std::vector<AddedKeyframe>
        keyframes;  // added to the map, in order; the caller enqueues them for the background stages
    std::optional<FrameId>
        deferred;  // the frame was passed to the keyframe maker; the caller enqueues it for its stage
    std::vector<tracking::CameraCounts>
        created_cameras;  // per camera: feature counts of the keyframe in FrameRecord::created; empty without one
    bool started_submap = false;                        // the first of `keyframes` is the root of a new submap
    std::vector<tracking::BetweenKeyframes> early;      // frames of a monocular initialisation, including the first
    std::vector<tracking::ObservedKeypoints> observed;  // per camera
  };

  // Tracks a frame in the version of the map that `executor` returns for it, and commits keyframes through `executor`.
  // `images`: one entry per camera of the rig.
  Outcome process(const image::ImageBundle& images, execution::StageExecutor& executor);

  // Resets tracking; the next frames initialise another map.
  void restart() { state_ = state_.restarted(); }

  // Sets the level of reduced work, from 0 (no reduction) to kMaxReduction, from the next frame on.
  void set_reduction(int level);
  int reduction() const { return state_.reduction; }

  // Frees memory that only further frames need.
  void free_scratch_memory() { preparation_.free_scratch_memory(); }

  const tracking::Tracker& tracker() const { return tracker_; }

  // Memory of the image pyramids of the last frame, and of the relocaliser's index of keyframes, in bytes.
  std::size_t pyramid_bytes() const { return preparation_.memory_bytes(); }
  std::size_t place_index_bytes() const { return tracker_.place_index_bytes(); }

 private:
  tracking::TrackOutcome track(const image::ImageBundle& images, const tracking::FramePlan& plan,
                               tracking::ImageFaults& faults, execution::StageExecutor& executor, Outcome& outcome,
                               std::vector<StageTime>& stages);
  bool drop_repeated(const map::BundledMap& map, tracking::ImageFaults& faults, frame::BundledFrame& frame);
  FrameId defer_keyframe(const tracking::FramePlan& plan, frame::BundledFrame frame,
                         const tracking::TrackOutcome& found);
  std::optional<tracking::CreatedKeyframe> adopt_keyframe(Outcome& outcome);
  tracking::TrackOutcome track_with_corrected_rig(const image::ImageBundle& images, const tracking::FramePlan& plan,
                                                  tracking::TrackOutcome&& tracked, execution::StageExecutor& executor,
                                                  Outcome& outcome);
  void commit(tracking::TrackOutcome& tracked, execution::StageExecutor& executor, Outcome& outcome);

  const Config& config_;
  ThreadPool pool_;
  tracking::CameraMonitor monitor_;
  tracking::CameraStatusMonitor status_;
  const std::vector<std::uint8_t> overlapping_;  // per camera: tracking::overlapping_cameras
  FramePreparation preparation_;
  tracking::Tracker tracker_;
  tracking::FrontEndState state_;
  KeyframeMaker* const keyframe_maker_;  // may be null
};

}  // namespace bslam::system
