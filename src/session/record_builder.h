// What the system knows of a run, as the plain record of summary and plots.
#pragma once

#include <vector>

#include "dataset/dataset.h"
#include "session/run_record.h"
#include "system/system.h"

namespace bslam::session {

// One input frame of the session, also those the system never saw.
struct InputFrame {
  TimeNs time_ns = 0;
  bool dropped = false;  // no time for it
  double read_ms = 0;
};

struct RecordInput {
  const dataset::Dataset& dataset;
  const system::Config& config;
  const std::vector<InputFrame>& inputs;  // in order; those not dropped match `frames` one by one
  const system::System& system;
  const std::vector<system::SubmapTrajectory>& trajectories;  // final
  bool replayed = false;
  bool loaded = false;  // the run went on in a saved map
  bool complete = true;
  double start_up_s = 0, wall_s = 0;
};

// Name of the file of the i-th part's poses: "trajectory.tum", "trajectory_part2.tum".
std::string trajectory_file(const std::string& stem, std::size_t submap);

// `frames`: all of the run, moved into the record.
RunRecord build_record(const RecordInput& input, std::vector<tracking::FrameRecord> frames);

}  // namespace bslam::session
