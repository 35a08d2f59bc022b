// Results of a run as plain numbers, from which summary.json and the plots are written. Times are in seconds since the
// first image of the data set unless the name contains another unit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/camera_pairs.h"
#include "calibration/image_residuals.h"
#include "calibration/late_camera.h"
#include "calibration/rig_refinement.h"
#include "tracking/frame_record.h"

namespace bslam::session {

enum class FrameOutcome {
  kTracked,
  kLost,     // processed, but without a pose
  kDropped,  // not processed, because processing was too slow
};

// One input frame of the run.
struct RunFrame {
  double time_s = 0.0;
  std::optional<tracking::FrameRecord> record;  // nullopt if the frame was dropped

  FrameOutcome outcome() const;
};

// The thread of a stage, by which the plots are grouped: the thread that processes each frame, or a background thread.
// Mapping, loop closing and global adjustment are background stages in all modes.
enum class StageThread { kCaller, kBackground };

struct StageSample {
  double time_s = 0.0;  // time of the processed frame
  double ms = 0.0;
};

// All calls of one stage (read, extract, bundle, ...), in order.
struct StageSeries {
  std::string name;
  StageThread thread = StageThread::kCaller;
  std::vector<StageSample> samples{};
};

// An interval of consecutive frames in which the status of a camera was the same.
struct CameraInterval {
  tracking::CameraStatus status;
  double from_s = 0.0, to_s = 0.0;
};

// Extrinsics of a camera estimated from the images of the run.
struct ExtrinsicsRecord {
  double change_deg = 0.0, change_mm = 0.0;  // difference from the calibration
  double std_deg = 0.0, std_mm = 0.0;        // standard deviations of the estimate
  bool rotation_observed = false, translation_observed = false, suspect = false, refined = false;
};

struct CameraRecord {
  std::string name;
  std::int64_t images = 0;
  std::int64_t skipped = 0;  // images that are listed in the data set but cannot be read
  std::vector<CameraInterval> states;
  std::optional<ExtrinsicsRecord> extrinsics = {};  // nullopt for camera 0, whose frame is the rig frame
  std::string first_skipped = {};                   // file and cause of damage of the first skipped image
  // Residuals of the keyframes of the run in the final map; if the run only localises, of the poses of its frames.
  calibration::ImageResiduals residuals = {};
  // Root mean square of the errors of its time stamps that the run corrected; 0 if they are small.
  double stamp_error_s = 0.0;
};

// A camera that was moved relative to the others during the run.
struct CameraMoveRecord {
  std::size_t camera = 0;
  double at_s = 0.0;  // of the first keyframe after it
  double change_deg = 0.0, std_deg = 0.0, change_mm = 0.0, std_mm = 0.0;
};

// The estimate of the calibration at the end of the run.
struct CalibrationRecord {
  calibration::RigRefinement estimate;
  // Whether the estimate can be used. If images of cameras disagree as a whole, it may have made a wrong calibration
  // fit wrong matches, or images that were taken at different times.
  bool applies = false;
  std::vector<CameraMoveRecord> moves = {};
  double jump_at_s = 0.0;     // time of estimate.jump
  bool moves_in_map = false;  // the map has extrinsics before and after the moves
  bool refined = false;       // the final map uses an estimated rig that applies, which is written to rig_refined.yaml
  double excess_bound = 0;    // the images contradict the calibration if estimate.excess_error is larger
  std::vector<calibration::CameraPair> pairs =
      {};  // pairs of cameras that are contradicted or hardly matched; without keyframes if no map was started
  int pairs_as_given =
      0;  // if no map was started or most frames were lost: pairs whose images agree with the calibration
  bool scale_unfounded = false;  // the scale is not reliable: there are no two consistent cameras that determine it
  std::vector<std::size_t> disagreeing = {};  // cameras that were inconsistent for most of the run
  // Cameras whose images neither the calibration nor its estimate explains as well as those of the others.
  std::vector<std::size_t> unexplained = {};
  bool replaced = false;  // the final map uses an estimated rig, whether it applies or not
  // Tested if the images contradict the calibration, or if a camera was inconsistent for some time.
  std::optional<calibration::LateCamera> late = {};

  // Sets `applies`, `replaced` and `refined`. `complete`: the run was not interrupted; the map of an interrupted run
  // may use an estimate from its beginning, of which nothing is known. `in_map`: the map uses an estimated rig.
  void accept_estimate(bool complete, bool in_map);
  // Returns true if cameras disagree with each other, so that a verdict from what agrees says little.
  bool is_doubtful() const;
  // Returns true if the images are not those of the calibrated cameras, or the calibration was read in a wrong
  // convention. Scale, map and estimate are meaningless then.
  bool foreign_images() const;
  // The verdict of the estimate, unless the pairs of cameras or single cameras show that it does not apply: the
  // estimate uses only observations that are consistent with each other.
  calibration::Verdict verdict() const;
};

struct MapRecord {
  std::int64_t keyframes = 0, landmarks = 0, observations = 0;
  std::string scale = "metric";  // metric, up-to-scale, unobservable
  bool loaded = false;
  std::optional<double> scale_deviation;  // relative standard deviation; nullopt if unknown
};

// A loop closure or relocalisation: the time of the frame, and the time of the matched keyframe.
struct PlaceEvent {
  double at_s = 0.0;
  double with_s = 0.0;
  int inliers = 0;
};

// A submap at the end of the run; each has its own world frame.
struct SubmapRecord {
  std::int64_t frames = 0;  // number of frames with a pose in it
  double from_s = 0.0, to_s = 0.0;
  std::string trajectory;  // name of the file with its final poses
  bool loaded = false;     // its world frame is that of the loaded map
};

// Counts of what a run did. They are exact: runs in sequential mode that give the same bytes have equal counts.
struct WorkRecord {
  // Number of images from which keypoints were extracted, and number of these keypoints.
  std::int64_t images = 0, keypoints = 0;
  std::int64_t solver_steps = 0;              // steps of nonlinear least squares, accepted or rejected
  std::optional<std::int64_t> allocations{};  // heap allocations; nullopt if not counted
};

// Memory of a part of a run at its end, or the largest size of a part that is only held temporarily. MB are 2^20 bytes.
struct MemoryPart {
  std::string name;
  double mb = 0.0;
  std::optional<double> largest_mb{};
};

struct MemoryReport {
  std::vector<MemoryPart> parts{};      // empty: it was not requested
  std::optional<double> resident_mb{};  // memory of the whole process when the parts were measured
  double sum_mb() const;                // sum of the parts
};

struct RunRecord {
  std::string version, data, mode;
  bool complete = true;
  std::uint64_t seed = 1;
  std::vector<int> cameras_used;
  std::vector<RunFrame> frames;       // all input frames, in order of time
  std::vector<CameraRecord> cameras;  // in the order of cameras_used
  std::vector<StageSeries> stages;
  MapRecord map;
  CalibrationRecord calibration;
  std::vector<PlaceEvent> loops, relocalisations;
  int maps_started = 0;
  std::vector<SubmapRecord> submaps;  // in decreasing order of frames
  double start_up_s = 0.0, wall_s = 0.0;
  std::optional<double> cpu_s{};  // processor time during wall_s, of all threads
  WorkRecord work{};
  MemoryReport memory{};
  std::optional<double> peak_memory_mb;    // maximum resident size; nullopt if unavailable
  std::vector<std::string> warnings = {};  // all that were printed
};

// Returns the number of frames with this outcome.
std::int64_t count(const RunRecord& record, FrameOutcome outcome);

// Returns the statuses of a camera over the frames that were not dropped; consecutive equal statuses are merged.
std::vector<CameraInterval> camera_intervals(std::span<const RunFrame> frames, std::size_t camera);

// Adds a call of a stage. The first call of a stage creates its series with the given thread.
void add_stage_sample(RunRecord& record, std::string_view stage, StageThread thread, StageSample sample);

// An interval of consecutive lost frames, from the first to the last one; dropped frames in between do not end it.
// `reason` is the reason of the first frame, for which tracking was lost.
struct LostInterval {
  double from_s = 0.0, to_s = 0.0;
  std::string reason;
};

std::vector<LostInterval> lost_intervals(const RunRecord& record);

// An interval of consecutive frames for which the same level of reduced work was done (tracking/reduced_work.h).
struct ReducedInterval {
  double from_s = 0.0, to_s = 0.0;
  int level = 0;
  std::int64_t frames = 0;
};

std::vector<ReducedInterval> reduced_intervals(const RunRecord& record);

// An interval with many frames whose pose was contested (tracking::MotionContest, tracking::kContestedFrames),
// including those of a map that was discarded for it.
struct ContestedInterval {
  double from_s = 0.0, to_s = 0.0;
  std::int64_t frames = 0;  // those that were contested
};

std::vector<ContestedInterval> contested_intervals(const RunRecord& record);

// Whether the images of several cameras could be used, but no map was started with them.
bool never_started(const RunRecord& record);
// Whether several cameras found no pose for most frames although there were images with features.
bool mostly_lost(const RunRecord& record);

// Whether the run ended before its first frame: it has no results that could replace those of an earlier one.
bool ended_at_once(const RunRecord& record);

// Returns the number of frames with a pose in the world frame of the loaded map.
std::int64_t frames_in_loaded_map(const RunRecord& record);

// Returns the share of a camera's matches with landmarks that support the pose of their frame; nullopt without matches.
std::optional<double> inlier_share(const RunRecord& record, std::size_t camera);
// The cameras whose reprojection error is more than twice the median of the others, while clearly fewer of their
// matches are inliers: their intrinsics, extrinsics or time stamps are wrong, although the errors of inliers hardly
// show it.
std::vector<std::size_t> unexplained_cameras(const RunRecord& record);

}  // namespace bslam::session
