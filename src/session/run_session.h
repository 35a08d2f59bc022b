// A run: feeds a data set or the images of live cameras to the SLAM system and writes the results as files.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "dataset/dataset.h"
#include "evaluation/trajectory.h"
#include "geometry/up_axis.h"
#include "session/frame_source.h"
#include "session/run_control.h"
#include "session/run_observer.h"
#include "session/run_record.h"
#include "system/config.h"
#include "system/system.h"

namespace bslam::session {

enum class Pace { kFast, kRealtime };  // kFast: as fast as possible; kRealtime: at the recorded pace
enum class Late { kBlock, kDrop };  // at the recorded pace: process every frame late, or do less work and drop frames

struct SessionOptions {
  system::Config config;
  Pace pace = Pace::kFast;
  Late late = Late::kBlock;
  double start_up_s = 0;                     // time spent before the session, for the record
  std::stop_token interrupted;               // a stop request ends the run early and keeps the results so far
  std::optional<execution::Journal> replay;  // journal of a run to repeat: exactly its frames are processed
  place::VocabularyPtr vocabulary;           // null: no place recognition
  std::optional<map::BundledMap> map;        // map of an earlier run with this rig, which is continued
  std::optional<camera::Rig> initial_rig;    // calibration with which the map begins; nullopt: that of the data set
  // Called after every frame with the number of frames so far and of all, 0 if that is not known; may be empty.
  std::function<void(std::size_t done, std::size_t all)> progress;
  RunObserver* observer = nullptr;  // may be null; must outlive the call
  RunControl* control = nullptr;    // pauses and pace, instead of `pace`; may be null; must outlive the call
  // The number of heap allocations of this process so far, for the record; empty: they are not counted.
  std::function<std::uint64_t()> allocations = {};
  bool memory_report = false;     // measure at the end which parts hold how much memory
  FrameSource* source = nullptr;  // frames instead of those of the data set; may be null; must outlive the call
};

struct SessionResult {
  RunRecord record;
  // One per submap. The first ones are written to trajectory.tum and trajectory_live.tum.
  std::vector<system::SubmapTrajectory> trajectories, live;
  map::MapSnapshot map;                    // its rig may have further cameras, if a map was loaded
  std::optional<camera::Rig> rig;          // rig of the run, with the calibration of the map
  calibration::RigRefinement calibration;  // the estimate of the calibration at the end of the run
  // If the calibration was refined and the estimate applies (CalibrationRecord::refined): the calibration of all
  // cameras, with the estimate for those in use.
  std::optional<camera::Rig> refined_rig;
  std::vector<std::string> refined_topics = {};  // the topics that the calibration names for them
  execution::Journal journal;
  // If set: subtracted from the times of all poses and covariances that are written, so that they are time stamps of
  // images. The times of frames contain the time offset of camera 0.
  std::optional<TimeNs> subtracted_ns = {};
};

// A data set without frames describes the rig of a `source`. Errors: a mask that cannot be read or differs in size from
// the images of its camera; a journal of another run.
Result<SessionResult> run_session(const dataset::Dataset& dataset, const SessionOptions& options);

// What report.html shows in addition to the result of a run.
struct ReportSource {
  const dataset::Dataset& dataset;
  std::string command;                      // the command line of the run
  std::optional<geometry::UpAxis> up = {};  // what points upward in its views
};

// Writes summary.json, trajectory.tum, trajectory_live.tum (further submaps: ..._part2.tum), config.yaml,
// rig_refined.yaml if extrinsics were refined, trajectory.svg, run.svg and, with a `report`, report.html, in this
// order. Each file is written completely or not at all. If one cannot be written, the others are written nevertheless.
// Returns an error for each that could not be.
std::vector<Error> write_outputs(const SessionResult& result, const system::Config& config,
                                 const std::filesystem::path& folder, const std::optional<ReportSource>& report = {});

}  // namespace bslam::session
