// What happened in a run, as plain numbers: the one source of summary.json and of the run's plots. Whoever drives the
// system fills it. Times are seconds since the first image of the data set unless a name says otherwise.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tracking/frame_record.h"

namespace bslam::session {

enum class FrameOutcome {
  kTracked,
  kLost,     // handed to the tracker and left without a pose
  kDropped,  // never handed to the tracker: no time for it
};

// One input frame of the run.
struct RunFrame {
  double time_s = 0.0;
  std::optional<tracking::FrameRecord> record;  // empty: dropped

  FrameOutcome outcome() const;
};

// Where a stage runs, for the plots: those of every frame apart from those beside it.
enum class StagePlace { kFrame, kBackground };

struct StageSample {
  double time_s = 0.0;  // of the frame it worked on
  double ms = 0.0;
};

// Every call of one stage (read, extract, bundle, ...), in order.
struct StageSeries {
  std::string name;
  StagePlace place = StagePlace::kFrame;
  std::vector<StageSample> samples{};
};

// A stretch of frames in which the status of a camera was the same.
struct CameraInterval {
  tracking::CameraStatus status;
  double from_s = 0.0, to_s = 0.0;
};

// What the images of the run say about the extrinsics of a camera.
struct ExtrinsicsRecord {
  double change_deg = 0.0, change_mm = 0.0, std_deg = 0.0, std_mm = 0.0;  // from the calibrated ones
  bool rotation_observed = false, translation_observed = false, suspect = false, refined = false;
};

struct CameraRecord {
  std::string name;
  std::int64_t images = 0;
  std::int64_t skipped = 0;  // listed in the data set, but not readable
  std::vector<CameraInterval> states;
  std::optional<ExtrinsicsRecord> extrinsics = {};  // none of camera 0, which is the rig
  std::string first_skipped = {};                   // file and cause of the first image that was not readable
};

struct MapRecord {
  std::int64_t keyframes = 0, landmarks = 0, observations = 0;
  std::string scale = "metric";  // metric, up-to-scale, unobservable
  bool loaded = false;
  std::optional<double> scale_deviation;  // relative standard deviation; empty where nothing is known of the scale
};

// A loop closed, or tracking found again: at one time, with the place seen at another.
struct PlaceEvent {
  double at_s = 0.0;
  double with_s = 0.0;
  int inliers = 0;
};

// A part of the map that no common place joined to the others, with a world of its own.
struct SubmapRecord {
  std::int64_t frames = 0;  // with a pose in it
  double from_s = 0.0, to_s = 0.0;
  std::string trajectory;  // file of its final poses
};

struct RunRecord {
  std::string version, data, mode;
  bool complete = true;
  std::uint64_t seed = 1;
  std::vector<int> cameras_used;
  std::vector<RunFrame> frames;       // every input frame, in order of time
  std::vector<CameraRecord> cameras;  // in the order of cameras_used
  std::vector<StageSeries> stages;
  MapRecord map;
  std::vector<PlaceEvent> loops, relocalisations;
  int maps_started = 0;
  std::vector<SubmapRecord> submaps;  // most frames first
  double start_up_s = 0.0, wall_s = 0.0;
  std::optional<double> peak_memory_mb;  // largest resident size of the process; empty where the system does not tell
};

// The statuses of camera `camera` over the frames that were not dropped, equal consecutive ones merged.
std::vector<CameraInterval> camera_intervals(std::span<const RunFrame> frames, std::size_t camera);

// Adds a call of a stage, making its series at the first.
void add_stage_sample(RunRecord& record, std::string_view stage, StagePlace place, StageSample sample);

// Frames lost one after another, as one stretch: from the first to the last of them. Dropped frames among them do not
// part it. The reason is that of the first: why tracking was lost, not why it was not found again.
struct LostInterval {
  double from_s = 0.0, to_s = 0.0;
  std::string reason;
};

std::vector<LostInterval> lost_intervals(const RunRecord& record);

}  // namespace bslam::session
