// The whole system: images in, poses out. Owns the map and the threads.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "adjustment/map_adjustment.h"
#include "base/result.h"
#include "camera/rig.h"
#include "evaluation/trajectory.h"
#include "execution/map_gate.h"
#include "execution/stage_executor.h"
#include "system/config.h"
#include "system/input_check.h"
#include "system/pipeline.h"
#include "system/stages.h"

namespace bslam::system {

// One run of a background stage.
struct StageRecord {
  execution::StageRun run;
  TimeNs time_ns = 0;  // of its keyframe
};

// What a run may be given besides rig and configuration.
struct Resources {
  std::vector<image::Image> masks = {};  // one per camera of the rig, an empty image = none; or no masks at all
  place::VocabularyPtr vocabulary = {};  // null: no place is recognised
  std::optional<map::BundledMap> map =
      {};  // of an earlier run with this rig; the run goes on in it once it finds its place
  std::optional<execution::Journal> replay = {};  // its run is repeated whatever the mode
  // For runs without end: records of this many last frames and stage runs at least are kept, and no journal. 0: all
  // are.
  std::size_t history = 0;
};

// Poses of one part of the map. Parts that no common place joined have worlds of their own.
struct SubmapTrajectory {
  KeyframeId root;
  evaluation::Trajectory poses;  // T_world_cam0
};

class System {
 public:
  // `resources`: masks of the size of their cameras' images. Where a journal is given, the frames must be those of the
  // journal, and calls throw ReplayMismatch where it does not fit.
  System(camera::Rig rig, Config config, Resources resources = {});
  ~System();

  // Tracks the next frame. `images`: one entry per camera of the rig, which may be missing. Errors, after which the run
  // goes on as if there had been no such call: those of check_frame (system/input_check.h). One thread calls. Throws
  // what a worker threw.
  Result<FrameRecord> process(const image::ImageBundle& images);

  // Waits for the stages and, where configured, adjusts the whole map. Call once, after the last frame.
  void finish();

  // From any thread, at any time: background stages and the adjustment at the end are stopped or left out, so that
  // whatever the caller's thread is in returns soon. What a stopped one had found does not come into the map.
  void interrupt();

  map::MapSnapshot snapshot() const { return store_.snapshot(); }
  // The last frames in order: all of the run, or at least Resources::history of them. Valid until the next
  // process().
  const std::vector<FrameRecord>& frames() const { return frames_; }
  // The same given away, which leaves none: for what is wanted of a run after its trajectories.
  std::vector<FrameRecord> take_frames() { return std::exchange(frames_, {}); }
  std::vector<StageRecord> stage_runs() const;
  execution::Journal journal() const {
    return gate_.journal();
  }  // what a replay needs; empty where the history is bounded
  double final_adjustment_ms() const { return final_adjustment_ms_; }
  const adjustment::AdjustmentReport& final_adjustment() const { return final_adjustment_; }
  // What finish() found about the extrinsics; not done where that was not asked for or not possible.
  const calibration::RigRefinement& extrinsics() const { return extrinsics_; }
  bool extrinsics_refined() const { return extrinsics_refined_; }  // and the map made with them
  double extrinsics_ms() const { return extrinsics_ms_; }
  int maps_started() const { return maps_started_; }

  std::vector<LoopRecord> loops() const;
  TimeNs keyframe_time(KeyframeId k) const;

  // Every frame of frames() that has a pose, resolved against the present map: a trajectory for each part of the map
  // that has some, the longest first.
  std::vector<SubmapTrajectory> trajectories() const;
  // The same as the caller was told at the time, never corrected, by parts as they were then; that of the longest final
  // trajectory first.
  std::vector<SubmapTrajectory> live_trajectories() const;

 private:
  bool refuted_young_map(const Pipeline::Outcome& outcome, bool had_pose) const;
  void give_up_young_map();
  void bound_history();
  void locate_early_frames();
  void check_extrinsics(map::MapDraft& draft, const std::stop_token& stop);
  void set_keyframe_time(KeyframeId k, TimeNs time_ns);

  const camera::Rig rig_;
  const Config config_;
  const bool loaded_;                // a map of an earlier run
  const KeyframeId first_keyframe_;  // of this run
  KeyframeId first_of_map_;          // after the last map that was withdrawn
  Pipeline pipeline_;
  const std::size_t history_;  // as in Resources
  std::optional<FrameStamp> last_input_;
  std::vector<FrameRecord> frames_;
  std::vector<tracking::BetweenKeyframes> early_;  // frames of before a start, by number
  mutable std::mutex records_mutex_;
  std::vector<StageRecord> stage_runs_;  // guarded by records_mutex_, as the two below
  std::vector<LoopRecord> loops_;
  std::vector<TimeNs> keyframe_time_ns_;  // by KeyframeId
  double final_adjustment_ms_ = 0, extrinsics_ms_ = 0;
  adjustment::AdjustmentReport final_adjustment_;
  calibration::RigRefinement extrinsics_;
  bool extrinsics_refined_ = false;
  int maps_started_ = 0;
  std::stop_source interruption_;
  map::MapStore store_;
  execution::MapGate gate_;
  std::unique_ptr<execution::StageExecutor> executor_;  // last: its threads end before the rest goes
};

}  // namespace bslam::system
