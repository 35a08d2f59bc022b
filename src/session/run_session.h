// An offline run: a data set through the system, and what comes out of it as a record and as files.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>

#include "evaluation/trajectory.h"
#include "io/dataset.h"
#include "report/run_record.h"
#include "system/config.h"

namespace bslam::session {

enum class Pace { kFast, kRealtime };  // as fast as it goes, or at the recorded pace
enum class Late { kBlock, kDrop };     // at the recorded pace: keep every frame, or leave out those there is no time for

struct SessionOptions {
  system::Config config;
  Pace pace = Pace::kFast;
  Late late = Late::kBlock;
  double start_up_s = 0;                            // spent before the session, for the record
  const std::atomic<bool>* interrupted = nullptr;   // looked at before every frame
  std::function<void(std::size_t done, std::size_t all)> progress;  // after every frame; may be empty
};

struct SessionResult {
  report::RunRecord record;
  evaluation::Trajectory trajectory, live;  // T_world_cam0
};

// Errors: a mask that cannot be read or has another size than its camera's images.
Result<SessionResult> run_session(const io::Dataset& dataset, const SessionOptions& options);

// trajectory.tum, trajectory_live.tum, summary.json, config.yaml, trajectory.svg and run.svg, each whole or not at all.
Status write_outputs(const SessionResult& result, const system::Config& config, const std::filesystem::path& folder);

}  // namespace bslam::session
