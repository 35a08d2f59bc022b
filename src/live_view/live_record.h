// The data of the live view: the session::RunRecord of a run in progress, which is built from a log of its frames.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "dataset/dataset.h"
#include "geometry/up_axis.h"
#include "live_view/frame_log.h"
#include "session/run_record.h"
#include "system/system.h"

namespace bslam::live_view {

// Results of background stages.
struct StageResults {
  std::vector<system::StageRecord> runs;
  std::vector<system::LoopRecord> loops;
  int maps_started = 0;
};

class LiveRecord {
 public:
  // `loaded_keyframes`: keyframe slots of the map with which the run began; 0: none was loaded. `dataset` must outlive
  // the record.
  LiveRecord(const dataset::Dataset& dataset, const system::Config& config, std::size_t loaded_keyframes);

  // Adds the next frames.
  void append(FrameLog&& frames);

  // Returns the data of the page (session/report_data.h) for the current map. The cost is proportional to the number of
  // frames, and so is the memory during the call. Poses, frames and landmarks are subsampled to a few thousand.
  nlohmann::ordered_json run_json(const map::BundledMap& map, const camera::Rig& rig, const StageResults& results,
                                  const std::optional<geometry::UpAxis>& up) const;

  // Seconds since the first image of the data set.
  double seconds(TimeNs time_ns) const { return to_seconds(time_ns - dataset_.first_time_ns); }

 private:
  std::vector<system::SubmapTrajectory> paths(const map::BundledMap& map) const;
  session::RunRecord record_of_frames() const;

  const dataset::Dataset& dataset_;
  const std::size_t loaded_keyframes_;
  session::RunRecord start_;  // what is known before the first frame
  FrameLog frames_;
};

}  // namespace bslam::live_view
