// The SLAM system: computes poses and a map from images. Owns the map and the threads.
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "evaluation/trajectory.h"
#include "execution/map_gate.h"
#include "execution/stage_executor.h"
#include "system/config.h"
#include "system/input_check.h"
#include "system/pipeline.h"
#include "system/run_records.h"
#include "tracking/map_doubt.h"

namespace bslam::system {

// Optional input of a run.
struct Resources {
  std::vector<image::Image> masks = {};  // one per camera of the rig, empty if it has no mask; or no masks at all
  place::VocabularyPtr vocabulary = {};  // null: no place recognition
  // Map of an earlier run with this or any other rig. The run continues in it after relocalisation. If the map already
  // has this rig, the run uses the calibration in the map, which may have been refined (map/rigs_of_map.h). Otherwise
  // it uses the given calibration and does not refine it.
  std::optional<map::BundledMap> map = {};
  // Initial calibration of a new map, such as the estimate of an earlier run; nullopt: that of the given rig. The given
  // rig is the prior of the refinement in either case. Not used with `map`, which contains a calibration.
  std::optional<camera::Rig> initial_rig = {};
  std::optional<execution::Journal> replay = {};  // repeats the run of this journal, regardless of the mode
  // Minimum number of latest frames and stage runs whose records are kept, for runs of unlimited duration; the journal
  // is not kept then. 0: all records and the journal are kept.
  std::size_t history = 0;
};

// Poses in one submap. Each submap has its own world frame.
struct SubmapTrajectory {
  KeyframeId root;
  evaluation::Trajectory poses;  // T_world_cam0
  bool loaded = false;           // the submap is part of the loaded map, so the poses are in its world frame
};

// The memory that a system holds, in bytes.
struct SystemMemory {
  map::MapMemory map;           // the newest version
  std::size_t place_index = 0;  // keyframe indices of loop closing and relocalisation
  std::size_t pyramids = 0;     // image pyramids of the last frames and their masks
};

class System {
 public:
  // The masks of `resources` must have the size of their cameras' images. If a journal is given, the frames must be
  // those of the journal, and calls throw ReplayMismatch if the run differs from it.
  System(camera::Rig rig, Config config, Resources resources = {});
  ~System();

  // Tracks the next frame. `images`: one entry per camera of the rig; images may be missing. Errors: see check_frame in
  // system/input_check.h; a call with an error has no effect on the run. All calls must come from one thread. Rethrows
  // exceptions of workers.
  Result<FrameRecord> process(const image::ImageBundle& images);

  // Sets the level of reduced work, from 0 (no reduction) to kMaxReduction (tracking/reduced_work.h), from the next
  // frame on. The journal records it. Must be called from the thread that calls process().
  void set_reduction(int level);

  // Waits for the stages and, if configured, adjusts the whole map. Must be called once, after the last frame.
  void finish();

  // Thread-safe, at any time. Stops or skips background stages and the adjustment at the end, so that the current call
  // of the caller's thread returns soon. Results of stopped stages are discarded.
  void interrupt();

  // The map. Its rig contains that of the run; if it was loaded, it may have cameras of other rigs as well.
  map::MapSnapshot snapshot() const { return store_.snapshot(); }
  // Keyframes before this one belong to a loaded map.
  KeyframeId first_keyframe() const { return first_keyframe_; }
  // Index in the rig of the map of the first camera of the run; the others follow in order.
  std::size_t first_camera() const { return cameras_.first; }
  // The rig of the run with the current calibration of the map.
  camera::Rig rig() const;
  // The latest frames in order: all frames of the run, or at least Resources::history of them. Valid until the next
  // process().
  const std::vector<FrameRecord>& frames() const { return frames_; }
  // Frames that became keyframes in the background after they had been tracked, as found out by the last call of
  // process() or finish(). The frame of that call may be among them.
  const std::vector<FrameRecord>& created_keyframes() const { return created_keyframes_; }
  // The keypoints of the last frame, per camera. Moves them out: they are empty until the next process().
  std::vector<tracking::ObservedKeypoints> take_observed_keypoints() { return std::exchange(observed_, {}); }
  // Moves the frames out; frames() is empty afterwards.
  std::vector<FrameRecord> take_frames() { return std::exchange(frames_, {}); }
  std::vector<StageRecord> stage_runs() const { return records_.stage_runs(); }
  // The journal for a replay; empty if the history is bounded.
  execution::Journal journal() const { return gate_.journal(); }
  double final_adjustment_ms() const { return final_adjustment_ms_; }
  // The estimate of the calibration by finish(); not `done` if it was not configured or not possible.
  const calibration::RigRefinement& calibration() const { return calibration_; }
  bool calibration_refined() const { return calibration_refined_; }  // true if the run replaced the rig of the map
  double calibration_ms() const { return calibration_ms_; }
  int maps_started() const { return maps_started_; }

  // To be called after finish().
  SystemMemory memory() const;

  // Those in the map; a map that is discarded takes its loops with it.
  std::vector<LoopRecord> loops() const { return records_.loops(); }
  TimeNs keyframe_time(KeyframeId k) const { return records_.keyframe_time(k); }

  // Poses of all frames() that have one, in the current map: one trajectory for each submap with poses, the longest
  // first.
  std::vector<SubmapTrajectory> trajectories() const;
  // Uncorrected poses as returned by process(), one trajectory per submap of that time. The submap with the longest
  // final trajectory is first.
  std::vector<SubmapTrajectory> live_trajectories() const;

 private:
  void discard_map();
  void bound_history();
  void locate_early_frames();
  void calibrate(map::MapDraft& draft, const std::stop_token& stop);
  void enqueue(FrameId frame, TimeNs time_ns);
  void mark_created_keyframes();

  const CamerasOfRun cameras_;  // indices in rig_
  const camera::Rig rig_;       // rig of the map, with the given calibration
  const camera::Rig run_rig_;   // rig of the run, as given
  const Config config_;
  const KeyframeId first_keyframe_;                    // first keyframe of this run
  std::optional<tracking::MapDoubt> doubt_;            // nullopt: the map was loaded and is never discarded
  const std::shared_ptr<looping::LoopCloser> closer_;  // null: no loops are closed
  KeyframeMaker keyframe_maker_;
  Pipeline pipeline_;
  const std::size_t history_;  // see Resources
  std::optional<FrameStamp> last_input_;
  std::vector<FrameRecord> frames_;
  std::vector<FrameRecord> created_keyframes_;
  std::vector<tracking::ObservedKeypoints> observed_;
  std::vector<tracking::BetweenKeyframes> early_;  // frames of monocular initialisations, in order of id
  RunRecords records_;
  double final_adjustment_ms_ = 0, calibration_ms_ = 0;
  calibration::RigRefinement calibration_;
  bool calibration_refined_ = false;
  int maps_started_ = 0;
  std::stop_source interruption_;
  map::MapStore store_;
  const std::shared_ptr<const camera::Rig> initial_rig_;  // rig of the map at the beginning of the run
  execution::MapGate gate_;
  std::unique_ptr<execution::StageExecutor> executor_;  // last member, so that its threads are joined first
};

}  // namespace bslam::system
