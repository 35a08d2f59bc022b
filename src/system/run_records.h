// What the threads of a run record about it: runs of background stages, loops, and keyframes with their times.
#pragma once

#include <map>
#include <mutex>
#include <vector>

#include "base/timestamp.h"
#include "execution/stage.h"
#include "system/stages.h"
#include "tracking/frame_record.h"

namespace bslam::system {

// One run of a background stage.
struct StageRecord {
  execution::StageRun run;
  TimeNs time_ns = 0;  // time of its keyframe
};

// Thread-safe.
class RunRecords {
 public:
  void add_loop(const LoopRecord& loop);

  // The time of the task's keyframe must be known; for Stage::kKeyframe, its frame must have been deferred.
  void add_stage_run(const execution::StageRun& run);

  void set_keyframe_time(KeyframeId k, TimeNs time_ns);

  // Records that a keyframe is being created from a frame in the background, until the run of that task is added.
  void add_deferred(FrameId frame, TimeNs time_ns);

  // Adds a keyframe that was created in the background, and its time.
  void add_created(const tracking::CreatedKeyframe& created, TimeNs time_ns);

  // The keyframes that were created since the last call.
  std::vector<tracking::CreatedKeyframe> take_created();

  // Returns true if keyframes are being created, or were created and have not been taken.
  bool creates_keyframes() const;

  // Forgets the loops of a map that is discarded, and the keyframes that were created for it. The times that its stages
  // took are kept: they were spent.
  void discard_map();

  // Drops the oldest stage runs but for this number.
  void keep_latest(std::size_t count);

  std::vector<StageRecord> stage_runs() const;
  std::vector<LoopRecord> loops() const;
  TimeNs keyframe_time(KeyframeId k) const;

 private:
  TimeNs take_time(const execution::StageTask& task);

  mutable std::mutex mutex_;
  std::vector<StageRecord> stage_runs_;
  std::vector<LoopRecord> loops_;
  std::vector<TimeNs> keyframe_time_ns_;            // by KeyframeId
  std::map<FrameId, TimeNs> deferred_time_ns_;      // frames from which keyframes are being created
  std::vector<tracking::CreatedKeyframe> created_;  // not taken yet
};

}  // namespace bslam::system
