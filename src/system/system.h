// The whole system: images in, poses out. Owns the map and the threads.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "camera/rig.h"
#include "evaluation/trajectory.h"
#include "system/config.h"
#include "system/frame_record.h"
#include "system/mapping_executor.h"
#include "system/pipeline.h"

namespace bslam::system {

// One run of the mapping stage, for the timing record.
struct MappingRecord {
  KeyframeId keyframe;
  TimeNs time_ns = 0;  // of the keyframe
  double ms = 0;
};

class System {
 public:
  // Masks: one per camera of the rig, empty = none.
  System(camera::Rig rig, Config config, std::vector<image::Image> masks = {});
  ~System();

  // Poses of the frame with these images; frames come in order of time. One thread calls. Throws what a worker threw.
  const FrameRecord& process(const image::ImageBundle& images);

  // Waits for the stages and, where configured, adjusts the whole map. Call once, after the last frame.
  void finish();

  map::MapSnapshot snapshot() const { return store_.snapshot(); }
  const std::vector<FrameRecord>& frames() const { return frames_; }
  std::vector<MappingRecord> mapping_runs() const;
  double final_adjustment_ms() const { return final_adjustment_ms_; }
  int maps_started() const { return maps_started_; }

  // T_world_cam0 of every frame that has a pose in the present map, resolved against it.
  evaluation::Trajectory trajectory() const;
  // The same as the caller was told at the time, never corrected.
  evaluation::Trajectory live_trajectory() const;

 private:
  void give_up_young_map();

  const camera::Rig rig_;
  const Config config_;
  Pipeline pipeline_;
  std::vector<FrameRecord> frames_;
  mutable std::mutex records_mutex_;
  std::vector<MappingRecord> mapping_runs_;  // guarded by records_mutex_
  double final_adjustment_ms_ = 0;
  int maps_started_ = 0;
  map::MapStore store_;
  std::unique_ptr<MappingExecutor> mapping_;  // last: its thread stops before the rest goes
};

}  // namespace bslam::system
