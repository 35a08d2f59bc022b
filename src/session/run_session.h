// An offline run: a data set through the system, and what comes out of it as a record and as files.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "dataset/dataset.h"
#include "evaluation/trajectory.h"
#include "session/run_record.h"
#include "system/config.h"
#include "system/system.h"

namespace bslam::session {

enum class Pace { kFast, kRealtime };  // as fast as it goes, or at the recorded pace
enum class Late { kBlock, kDrop };  // at the recorded pace: keep every frame, or leave out those there is no time for

struct SessionOptions {
  system::Config config;
  Pace pace = Pace::kFast;
  Late late = Late::kBlock;
  double start_up_s = 0;                     // spent before the session, for the record
  std::stop_token interrupted;               // ends the run soon, with what exists so far
  std::optional<execution::Journal> replay;  // of a run to be repeated: its frames, and no more than those
  place::VocabularyPtr vocabulary;           // null: no place is recognised
  std::optional<map::BundledMap> map;        // of an earlier run with this rig, to go on in
  std::function<void(std::size_t done, std::size_t all)> progress;  // after every frame; may be empty
};

struct SessionResult {
  RunRecord record;
  std::vector<system::PartTrajectory> trajectories,
      live;  // the first are those of trajectory.tum and trajectory_live.tum
  map::MapSnapshot map;
  // Where extrinsics were refined: all cameras of the calibration, those in use with what was found.
  std::optional<camera::Rig> refined_rig;
  execution::Journal journal;
};

// Errors: a mask that cannot be read or has another size than its camera's images; a journal that is not of this run.
Result<SessionResult> run_session(const dataset::Dataset& dataset, const SessionOptions& options);

// trajectory.tum, trajectory_live.tum (further parts of the map: ..._part2.tum), summary.json, config.yaml,
// trajectory.svg, run.svg and, where extrinsics were refined, rig_refined.yaml, each whole or not at all.
Status write_outputs(const SessionResult& result, const system::Config& config, const std::filesystem::path& folder);

}  // namespace bslam::session
