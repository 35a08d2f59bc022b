// The data of the live view: the session::RunRecord of a run in progress, extended with every frame.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "dataset/dataset.h"
#include "geometry/up_axis.h"
#include "session/run_record.h"
#include "system/system.h"

namespace bslam::live_view {

// An input frame of the run.
struct InputFrame {
  TimeNs time_ns = 0;
  std::optional<tracking::FrameRecord> record;  // nullopt if it was dropped
  double read_ms = 0;
  TimeNs relocalised_with_ns = 0;  // time of the keyframe, if the frame was relocalised
};

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

  void add(InputFrame&& frame);

  // Returns the data of the page (session/report_data.h) for the current map. The cost is proportional to the number of
  // frames. Poses, frames and landmarks are subsampled to a few thousand.
  nlohmann::ordered_json run_json(const map::BundledMap& map, const camera::Rig& rig, const StageResults& results,
                                  const std::optional<geometry::UpAxis>& up);

  // Seconds since the first image of the data set.
  double seconds(TimeNs time_ns) const { return to_seconds(time_ns - dataset_.first_time_ns); }

 private:
  std::vector<system::SubmapTrajectory> paths(const map::BundledMap& map) const;
  void withdraw_map();

  const dataset::Dataset& dataset_;
  const std::size_t loaded_keyframes_;
  session::RunRecord record_;
  std::vector<session::StageSeries> caller_stages_;
};

}  // namespace bslam::live_view
