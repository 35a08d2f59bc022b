// One frame through the stages of the caller's thread: extract, bundle, then start or track, then perhaps a keyframe.
#pragma once

#include <memory>
#include <optional>

#include "base/thread_pool.h"
#include "execution/stage_executor.h"
#include "looping/relocalise.h"
#include "matching/frame_builder.h"
#include "system/config.h"
#include "system/frame_record.h"
#include "tracking/initialise.h"
#include "tracking/pose_between.h"
#include "tracking/track.h"

namespace bslam::system {

class Pipeline {
 public:
  // `recogniser` may be null: then a lost rig is looked for only where it was lost.
  Pipeline(const camera::Rig& rig, const Config& config, std::vector<image::Image> masks,
           std::unique_ptr<looping::PlaceRecogniser> recogniser = nullptr);

  struct Outcome {
    FrameRecord record;
    map::MapSnapshot seen;              // version of the map the frame was tracked in
    std::vector<KeyframeId> keyframes;  // added to the map, in order: the background stages are due for them
    bool began_part = false;            // the first of them begins a part of the map
    std::vector<tracking::BetweenKeyframes> early;  // frames a start up to scale was made over, the first among them
  };

  // Reads the version of the map that `executor` gives the frame and commits keyframes to it.
  Outcome process(const image::ImageBundle& images, execution::StageExecutor& executor);

  // Extraction and bundling alone; cameras with left_out[i] != 0 are taken as without an image.
  frame::BundledFrame make_frame(const image::ImageBundle& images, std::vector<StageTime>& stages,
                                 std::span<const std::uint8_t> left_out = {});

  // Forgets the map that was tracked; the next frames start another.
  void restart();

  // Where a frame of before the start is in the map as it is now.
  std::optional<tracking::TrackResult> locate_early(const map::BundledMap& map,
                                                    const tracking::BetweenKeyframes& early);

  const tracking::TrackerState& state() const { return state_; }

 private:
  void trust_what_is_sharp_again(const std::vector<std::uint8_t>& blurred);
  std::vector<std::uint8_t> left_out(const image::ImageBundle& images,
                                     const std::vector<tracking::Outage>& outages) const;
  std::vector<matching::AlignmentOptions> alignment() const;  // per camera, as it is known at present
  void apply_scale_change(const map::BundledMap& map);
  void start(frame::BundledFrame frame, execution::StageExecutor& executor, Outcome& outcome);
  void keep_candidate(frame::BundledFrame frame);
  void track(frame::BundledFrame frame, execution::StageExecutor& executor, Outcome& outcome);
  tracking::TrackOutput follow(frame::BundledFrame& frame, const map::BundledMap& map);
  bool find_again(frame::BundledFrame& frame, const map::BundledMap& map, Outcome& outcome);
  void note_motion(const map::BundledMap& map, const tracking::TrackerState& before, FrameRecord& record);
  void add_keyframe(frame::BundledFrame& frame, const tracking::TrackOutput& output, execution::StageExecutor& executor,
                    Outcome& outcome);

  const camera::Rig& rig_;
  const Config& config_;
  ThreadPool pool_;
  tracking::CameraMonitor monitor_;
  std::vector<std::uint8_t> blurred_;  // cameras in the last frame
  matching::FrameBuilder builder_;
  std::vector<double> feature_shares_;  // of the cameras in the next frame's feature budget; empty: even
  std::vector<double> error_floors_;    // of the cameras, for the next frame; empty: nothing is known
  tracking::TrackerState state_;
  std::optional<tracking::StartCandidate> candidate_;
  std::vector<std::shared_ptr<const frame::BundledFrame>> early_;  // the candidate and the frames since
  const std::unique_ptr<looping::PlaceRecogniser> recogniser_;
  int frames_lost_ = 0;  // with something to see, one after the other
  geometry::SE3 T_rig_odom_, T_map_odom_;
};

}  // namespace bslam::system
