#include "session/record_builder.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "dataset/frame_reader.h"
#include "session/image_test.h"
#include "session/process_use.h"

namespace bslam::session {
namespace {

double seconds(const RecordInput& input, TimeNs time_ns) { return to_seconds(time_ns - input.dataset.first_time_ns); }

// The residuals of the poses of a run that adds no keyframes to its map, without their distribution over the image.
calibration::ImageResiduals residuals_of_frames(const RunRecord& record, std::size_t camera,
                                                calibration::ImageResiduals empty) {
  double sum_px2 = 0;
  for (const RunFrame& frame : record.frames) {
    if (frame.outcome() != FrameOutcome::kTracked) continue;
    const tracking::CameraCounts& counts = frame.record->final_result().cameras[camera];
    empty.observations += static_cast<std::size_t>(counts.inliers);
    sum_px2 += counts.squared_error_px2;
  }
  if (empty.observations > 0) empty.rms_px = std::sqrt(sum_px2 / static_cast<double>(empty.observations));
  return empty;
}

// Root mean square of the corrections of the capture times of a camera in the keyframes of the run; 0 if hardly any are
// larger than those that errors of the calibration cause.
double stamp_error_s(const map::BundledMap& map, KeyframeId first, std::size_t camera) {
  constexpr double kLarge_s = 0.5e-3;
  double sum = 0;
  int count = 0;
  for (const KeyframeId k : map.keyframe_ids()) {
    const frame::CameraFrame& image = map.keyframe(k).frame->cameras[camera];
    if (k < first || image.state != image::ImageState::kPresent) continue;
    sum += std::pow(to_seconds(image.correction_ns), 2);
    ++count;
  }
  const double error_s = count > 0 ? std::sqrt(sum / count) : 0.0;
  return error_s < kLarge_s ? 0.0 : error_s;
}

void add_cameras(const RecordInput& input, RunRecord& record) {
  const std::vector<calibration::ImageResiduals> residuals =
      calibration::image_residuals(*input.system.snapshot(), input.system.first_keyframe());
  for (std::size_t c = 0; c < input.dataset.rig.size(); ++c) {
    CameraRecord camera;
    camera.name = input.dataset.rig.camera(c).name;
    for (const RunFrame& frame : record.frames) {
      if (!frame.record) continue;
      const image::ImageState image = frame.record->images[c];
      camera.images += image == image::ImageState::kPresent;
      if (image != image::ImageState::kDamaged || camera.skipped++ > 0) continue;
      camera.first_skipped = dataset::describe_damage(input.dataset, frame.record->result.frame.index(), c);
    }
    camera.states = camera_intervals(record.frames, c);
    camera.residuals = residuals[input.system.first_camera() + c];
    if (input.config.localize_only) camera.residuals = residuals_of_frames(record, c, std::move(camera.residuals));
    camera.stamp_error_s =
        stamp_error_s(*input.system.snapshot(), input.system.first_keyframe(), input.system.first_camera() + c);
    const auto& found = input.system.calibration().cameras;
    if (c > 0 && c < found.size()) {
      const calibration::CameraRefinement& r = found[c];
      camera.extrinsics = {r.change_deg,
                           r.change_mm,
                           r.std_deg,
                           r.std_mm,
                           r.rotation_observed(),
                           r.translation_observed(),
                           r.suspect,
                           input.system.calibration_refined()};
    }
    record.cameras.push_back(std::move(camera));
  }
}

// Fraction of the time in which a camera delivered images and its status was `inconsistent`.
double inconsistent_fraction(const CameraRecord& camera) {
  double all_s = 0, inconsistent_s = 0;
  for (const CameraInterval& s : camera.states) {
    if (s.status.reason == tracking::CameraReason::kNoImages) continue;
    all_s += s.to_s - s.from_s;
    if (s.status.reason == tracking::CameraReason::kInconsistent) inconsistent_s += s.to_s - s.from_s;
  }
  return all_s > 0 ? inconsistent_s / all_s : 0.0;
}

bool was_inconsistent(const CameraRecord& camera) {
  return std::ranges::any_of(camera.states, [](const CameraInterval& interval) {
    return interval.status.reason == tracking::CameraReason::kInconsistent;
  });
}

// Returns true if the scale is not reliable: all cameras with images but one have been inconsistent with that one
// nearly from the start.
bool single_camera_agrees(const RunRecord& record) {
  constexpr double kNearlyAlways = 0.9;
  const auto used = std::ranges::count_if(record.cameras, [](const CameraRecord& camera) { return camera.images > 0; });
  const auto contradicted = std::ranges::count_if(record.cameras, [](const CameraRecord& camera) {
    return camera.images > 0 && inconsistent_fraction(camera) > kNearlyAlways;
  });
  return used > 1 && contradicted + 1 >= used;
}

// Returns true if there is evidence against the calibration or the time stamps.
bool is_contradicted(const CalibrationRecord& calibration) {
  return calibration.is_doubtful() || calibration.estimate.verdict == calibration::Verdict::kInconsistent;
}

void add_calibration(const RecordInput& input, RunRecord& record) {
  CalibrationRecord& calibration = record.calibration;
  calibration.estimate = input.system.calibration();
  calibration.excess_bound = input.config.calibration.inconsistent_excess;
  calibration.moves_in_map = !input.system.rig().moves().empty();
  for (const calibration::MoveEstimate& m : calibration.estimate.moves)
    calibration.moves.push_back({m.camera, seconds(input, m.time_ns), m.change_deg, m.std_deg, m.change_mm, m.std_mm});
  if (const auto& jump = calibration.estimate.jump) calibration.jump_at_s = seconds(input, jump->time_ns);
  const bool suspected = calibration.estimate.verdict == calibration::Verdict::kInconsistent ||
                         input.system.snapshot()->scale() != map::Scale::kMetric;
  calibration.pairs =
      calibration::disagreeing_pairs(*input.system.snapshot(), input.system.first_keyframe(),
                                     input.system.first_camera(), input.dataset.rig, input.system.rig(), suspected);
  for (std::size_t c = 0; c < record.cameras.size(); ++c) {
    if (inconsistent_fraction(record.cameras[c]) > 0.5) calibration.disagreeing.push_back(c);
  }
  // A run that only localises has no keyframes with which pairs could be tested.
  const bool untested = input.config.localize_only && !calibration.disagreeing.empty();
  if (input.complete && (never_started(record) || mostly_lost(record) || untested)) {
    PairsWithoutMap found = pairs_without_map(input.dataset);
    if (!found.contradicted.empty()) calibration.pairs = std::move(found.contradicted);
    calibration.pairs_as_given = found.as_given;
  }
  if (input.complete && (is_contradicted(calibration) || std::ranges::any_of(record.cameras, was_inconsistent)))
    calibration.late = late_camera(input.dataset, input.system.rig());
  calibration.unexplained = unexplained_cameras(record);
  calibration.accept_estimate(input.complete, input.system.calibration_refined());
  for (CameraRecord& camera : record.cameras) {
    if (camera.extrinsics) camera.extrinsics->refined = calibration.refined;
  }
  calibration.scale_unfounded = calibration.foreign_images() || (!record.map.loaded && single_camera_agrees(record));
  if (calibration.scale_unfounded && record.map.scale == map::scale_name(map::Scale::kMetric)) {
    record.map.scale = map::scale_name(map::Scale::kUnobservable);
    record.map.scale_deviation.reset();
  }
}

void add_stages(const RecordInput& input, RunRecord& record) {
  for (std::size_t i = 0; i < input.inputs.size(); ++i) {
    const RunFrame& frame = record.frames[i];
    add_stage_sample(record, "read", StageThread::kBackground, {frame.time_s, input.inputs[i].read_ms});
    if (!frame.record) continue;
    for (const tracking::StageTime& s : frame.record->stages)
      add_stage_sample(record, s.stage, StageThread::kCaller, {frame.time_s, s.ms});
  }
  for (const system::StageRecord& s : input.system.stage_runs()) {
    add_stage_run(record, s, input.dataset.first_time_ns);
  }
  if (input.system.final_adjustment_ms() > 0 && !input.inputs.empty()) {
    add_stage_sample(record, "global adjustment", StageThread::kBackground,
                     {seconds(input, input.inputs.back().time_ns), input.system.final_adjustment_ms()});
  }
  if (input.system.calibration_ms() > 0 && !input.inputs.empty()) {
    add_stage_sample(record, "calibration", StageThread::kBackground,
                     {seconds(input, input.inputs.back().time_ns), input.system.calibration_ms()});
  }
}

void add_places(const RecordInput& input, RunRecord& record) {
  for (const system::LoopRecord& loop : input.system.loops()) {
    record.loops.push_back({seconds(input, loop.time_ns), seconds(input, loop.with_time_ns), loop.closure.inliers});
  }
  for (const RunFrame& frame : record.frames) {
    if (!frame.record || !frame.record->relocalisation) continue;
    const tracking::Relocalisation& found = *frame.record->relocalisation;
    const TimeNs with_ns = input.system.keyframe_time(found.matched_keyframe);
    record.relocalisations.push_back(
        {seconds(input, frame.record->result.time_ns), seconds(input, with_ns), found.inliers});
  }
  const auto& submaps = input.trajectories;
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    const evaluation::Trajectory& poses = submaps[i].poses;
    record.submaps.push_back({static_cast<std::int64_t>(poses.size()), seconds(input, poses.front().time_ns),
                              seconds(input, poses.back().time_ns), trajectory_file("trajectory", i),
                              submaps[i].loaded});
  }
}

}  // namespace

std::string trajectory_file(const std::string& stem, std::size_t submap) {
  return submap == 0 ? stem + ".tum" : stem + "_part" + std::to_string(submap + 1) + ".tum";
}

std::string_view mode_name(execution::Mode mode) {
  for (const auto& [value, name] : EnumNames<execution::Mode>::kNames) {
    if (value == mode) return name;
  }
  return "";
}

void add_stage_run(RunRecord& record, const system::StageRecord& run, TimeNs first_time_ns) {
  add_stage_sample(record, execution::stage_name(run.run.task.stage), StageThread::kBackground,
                   {to_seconds(run.time_ns - first_time_ns), run.run.ms});
}

MapRecord map_record(const map::BundledMap& map, bool loaded) {
  const bool never_metric = map.num_keyframes() == 0 && map.rig().size() == 1;
  MapRecord record{static_cast<std::int64_t>(map.num_keyframes()),
                   static_cast<std::int64_t>(map.num_landmarks()),
                   static_cast<std::int64_t>(map.num_observations()),
                   std::string(map::scale_name(never_metric ? map::Scale::kUpToScale : map.scale())),
                   loaded,
                   {}};
  if (std::isfinite(map.scale_deviation()) && map.scale_deviation() > 0) record.scale_deviation = map.scale_deviation();
  return record;
}

RunRecord build_record(const RecordInput& input, std::vector<tracking::FrameRecord> frames) {
  RunRecord record;
  record.version = BSLAM_VERSION;
  record.data = input.dataset.name;
  record.mode = input.replayed ? "replay" : mode_name(input.config.mode);
  record.complete = input.complete;
  record.seed = static_cast<std::uint64_t>(input.config.seed);
  record.cameras_used = input.dataset.cameras_used;
  record.frames.reserve(input.inputs.size());
  std::size_t next = 0;
  for (const InputFrame& in : input.inputs) {
    RunFrame& frame = record.frames.emplace_back(RunFrame{seconds(input, in.time_ns), {}});
    if (!in.dropped) frame.record = std::move(frames[next++]);
  }
  add_cameras(input, record);
  add_stages(input, record);
  const map::MapSnapshot map = input.system.snapshot();
  record.map = map_record(*map, input.loaded);
  record.maps_started = input.system.maps_started();
  add_calibration(input, record);
  add_places(input, record);
  record.start_up_s = input.start_up_s;
  record.wall_s = input.wall_s;
  record.peak_memory_mb = peak_memory_mb();
  return record;
}

}  // namespace bslam::session
