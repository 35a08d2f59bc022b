// Builds the record of a run, from which summary and plots are written, from the state of the system.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "dataset/dataset.h"
#include "session/run_record.h"
#include "system/system.h"

namespace bslam::session {

// One input frame of the session, including frames that were not passed to the system.
struct InputFrame {
  TimeNs time_ns = 0;
  bool dropped = false;  // not processed, because processing was too slow
  double read_ms = 0;
};

struct RecordInput {
  const dataset::Dataset& dataset;
  const system::Config& config;
  const std::vector<InputFrame>& inputs;  // in order; the inputs that were not dropped correspond to `frames`
  const system::System& system;
  const std::vector<system::SubmapTrajectory>& trajectories;  // final poses
  bool replayed = false;
  bool loaded = false;  // the run continued a saved map
  bool complete = true;
  double start_up_s = 0, wall_s = 0;
};

// Returns the name of the file with the poses of submap `submap`: "trajectory.tum", "trajectory_part2.tum".
std::string trajectory_file(const std::string& stem, std::size_t submap);

std::string_view mode_name(execution::Mode mode);

// Adds one call of a background stage to the record.
void add_stage_run(RunRecord& record, const system::StageRecord& run, TimeNs first_time_ns);

// Returns the counts and the scale of a map for the record.
MapRecord map_record(const map::BundledMap& map, bool loaded);

// `frames` contains all frames passed to the system, which are moved into the record.
RunRecord build_record(const RecordInput& input, std::vector<tracking::FrameRecord> frames);

}  // namespace bslam::session
