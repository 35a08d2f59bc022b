// One frame through the stages of the caller's thread: extract, bundle, then start or track, then perhaps a keyframe.
#pragma once

#include <memory>
#include <optional>

#include "base/thread_pool.h"
#include "frame/frame_builder.h"
#include "map/map_store.h"
#include "system/config.h"
#include "system/frame_record.h"
#include "tracking/initialise.h"
#include "tracking/track.h"

namespace bslam::system {

class Pipeline {
 public:
  Pipeline(const camera::Rig& rig, const Config& config, std::vector<image::Image> masks);

  struct Outcome {
    FrameRecord record;
    std::vector<KeyframeId> keyframes;  // added to the map, in order: mapping is due for them
  };

  // Reads the newest version of the map and commits keyframes to it.
  Outcome process(const image::ImageBundle& images, map::MapStore& store);

  // Extraction and bundling alone.
  frame::BundledFrame make_frame(const image::ImageBundle& images, std::vector<StageTime>& stages);

  // Forgets the map that was tracked; the next frames start another.
  void restart();

  const tracking::TrackerState& state() const { return state_; }

 private:
  void start(frame::BundledFrame frame, map::MapStore& store, Outcome& outcome);
  void keep_candidate(frame::BundledFrame frame);
  void track(frame::BundledFrame frame, map::MapStore& store, Outcome& outcome);
  void add_keyframe(const frame::BundledFrame& frame, const tracking::TrackOutput& output, map::MapSnapshot base,
                    map::MapStore& store, Outcome& outcome);

  const camera::Rig& rig_;
  const Config& config_;
  ThreadPool pool_;
  frame::FrameBuilder builder_;
  tracking::TrackerState state_;
  std::optional<tracking::StartCandidate> candidate_;
};

}  // namespace bslam::system
