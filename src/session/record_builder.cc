#include "session/record_builder.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include "base/median.h"
#include "dataset/frame_reader.h"

namespace bslam::session {
namespace {

using report::RunRecord;

constexpr int kFewKeypoints = 30;  // in an image: a camera that sees less helps nobody

double seconds(const RecordInput& input, TimeNs time_ns) { return to_seconds(time_ns - input.dataset.first_time_ns); }

report::FrameRecord frame_record(const RecordInput& input, const InputFrame& in, const system::FrameRecord* frame) {
  report::FrameRecord out;
  out.time_s = seconds(input, in.time_ns);
  if (frame == nullptr) {
    out.outcome = report::FrameOutcome::kDropped;
    return out;
  }
  const tracking::TrackResult& result = frame->final_result();
  const bool tracked = result.status == tracking::TrackStatus::kTracking;
  out.outcome = tracked ? report::FrameOutcome::kTracked : report::FrameOutcome::kLost;
  if (!tracked) out.lost_reason = tracking::describe(result.reason);
  out.keyframe = frame->keyframe;
  for (std::size_t c = 0; c < frame->images.size(); ++c) {
    const tracking::CameraCounts& n = result.cameras[c];
    out.cameras.push_back({frame->images[c] == image::ImageState::kPresent, n.keypoints, n.matched, n.inliers});
  }
  out.unique_features = frame->unique;
  out.monocular_features = frame->monocular;
  out.matched_features = frame->matched;
  out.frame_ms = frame->frame_ms;
  return out;
}

// State of a camera in one frame, from what it delivered.
report::CameraInterval camera_state(const report::FrameRecord& frame, const system::FrameRecord& known, std::size_t c) {
  const tracking::Outage outage = known.outages[c];
  const bool used = outage == tracking::Outage::kNone;
  if (known.blurred[c] && (used || outage == tracking::Outage::kInconsistent)) {  // blur explains that it sees little
    return {used ? "degraded" : "out", "blurred", frame.time_s, frame.time_s};
  }
  if (!used) return {"out", std::string(tracking::describe(outage)), frame.time_s, frame.time_s};
  if (frame.cameras[c].keypoints < kFewKeypoints && !known.waiting[c])
    return {"degraded", "few-features", frame.time_s, frame.time_s};
  return {"ok", "", frame.time_s, frame.time_s};
}

// Frames without an image of camera c that are no outage: it fires at a lower rate than the frames come.
std::vector<std::uint8_t> between_images(const std::vector<system::FrameRecord>& frames, std::size_t c) {
  std::vector<std::size_t> at;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    if (frames[k].images[c] == image::ImageState::kPresent) at.push_back(k);
  }
  std::vector<std::uint8_t> out(frames.size(), 0);
  if (at.size() < 2) return out;
  std::vector<std::size_t> steps;
  for (std::size_t i = 1; i < at.size(); ++i) steps.push_back(at[i] - at[i - 1]);
  const std::size_t step = lower_median(std::move(steps));
  for (std::size_t i = 1; i < at.size(); ++i) {
    if (at[i] - at[i - 1] > step) continue;
    const auto first = out.begin() + static_cast<std::ptrdiff_t>(at[i - 1]),
               last = out.begin() + static_cast<std::ptrdiff_t>(at[i]);
    std::fill(first, last, std::uint8_t{1});
  }
  // Its first image may come, and the next one after the end, as late as others do.
  const auto until = static_cast<std::ptrdiff_t>(at.front() < step ? at.front() : 0);
  std::fill(out.begin(), out.begin() + until, std::uint8_t{1});
  if (frames.size() - at.back() <= step)
    std::fill(out.begin() + static_cast<std::ptrdiff_t>(at.back()), out.end(), std::uint8_t{1});
  return out;
}

void add_cameras(const RecordInput& input, RunRecord& record) {
  const auto& frames = input.system.frames();
  for (std::size_t c = 0; c < input.dataset.rig.size(); ++c) {
    report::CameraRecord camera;
    camera.name = input.dataset.rig.camera(c).name;
    for (const system::FrameRecord& f : frames) {
      camera.images += f.images[c] == image::ImageState::kPresent;
      if (f.images[c] != image::ImageState::kDamaged) continue;
      if (camera.skipped++ == 0) camera.first_skipped = dataset::why_damaged(input.dataset, f.result.frame.index(), c);
    }
    const std::vector<std::uint8_t> pause = between_images(frames, c);
    std::size_t next = 0;
    for (const report::FrameRecord& f : record.frames) {
      if (f.cameras.empty()) continue;  // dropped: the system never saw it
      const std::size_t k = next++;
      const bool waiting = pause[k] && frames[k].outages[c] == tracking::Outage::kNoImage;
      const report::CameraInterval state =
          waiting ? report::CameraInterval{"ok", "", f.time_s, f.time_s} : camera_state(f, frames[k], c);
      if (camera.states.empty() || camera.states.back().state != state.state ||
          camera.states.back().reason != state.reason) {
        camera.states.push_back(state);
      }
      camera.states.back().to_s = f.time_s;
    }
    const auto& found = input.system.extrinsics().cameras;
    if (c > 0 && c < found.size()) {
      const calibration::CameraRefinement& r = found[c];
      camera.extrinsics = {r.change_deg,
                           r.change_mm,
                           r.std_deg,
                           r.std_mm,
                           r.rotation_observed(),
                           r.translation_observed(),
                           r.suspect,
                           input.system.extrinsics_refined()};
    }
    record.cameras.push_back(std::move(camera));
  }
}

void add_stages(const RecordInput& input, RunRecord& record) {
  std::size_t next = 0;
  for (const InputFrame& in : input.inputs) {
    const double time_s = seconds(input, in.time_ns);
    report::add_stage_sample(record, "read", report::StagePlace::kBackground, {time_s, in.read_ms});
    if (in.dropped) continue;
    for (const system::StageTime& s : input.system.frames()[next].stages) {
      report::add_stage_sample(record, s.stage, report::StagePlace::kFrame, {time_s, s.ms});
    }
    ++next;
  }
  for (const system::StageRecord& s : input.system.stage_runs()) {
    report::add_stage_sample(record, execution::stage_name(s.run.task.stage), report::StagePlace::kBackground,
                             {seconds(input, s.time_ns), s.run.ms});
  }
  if (input.system.final_adjustment_ms() > 0 && !input.inputs.empty()) {
    report::add_stage_sample(record, "global adjustment", report::StagePlace::kBackground,
                             {seconds(input, input.inputs.back().time_ns), input.system.final_adjustment_ms()});
  }
  if (input.system.extrinsics_ms() > 0 && !input.inputs.empty()) {
    report::add_stage_sample(record, "extrinsics", report::StagePlace::kBackground,
                             {seconds(input, input.inputs.back().time_ns), input.system.extrinsics_ms()});
  }
}

void add_places(const RecordInput& input, RunRecord& record) {
  for (const system::LoopRecord& loop : input.system.loops()) {
    record.loops.push_back({seconds(input, loop.time_ns), seconds(input, loop.with_time_ns), loop.closure.inliers});
  }
  for (const system::FrameRecord& f : input.system.frames()) {
    if (!f.relocalisation) continue;
    const TimeNs with_ns = input.system.keyframe_time(f.relocalisation->with);
    record.relocalisations.push_back(
        {seconds(input, f.result.time_ns), seconds(input, with_ns), f.relocalisation->inliers});
  }
  const auto parts = input.system.trajectories();
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const evaluation::Trajectory& poses = parts[i].poses;
    record.parts.push_back({static_cast<std::int64_t>(poses.size()), seconds(input, poses.front().time_ns),
                            seconds(input, poses.back().time_ns), trajectory_file("trajectory", i)});
  }
}

// When stages ran.
std::string mode_name(const RecordInput& input) {
  if (input.replayed) return "replay";
  for (const auto& [mode, name] : EnumNames<execution::Mode>::kNames) {
    if (mode == input.config.mode) return std::string(name);
  }
  return "";
}

// Largest resident size of this process, as Linux tells it.
std::optional<double> peak_memory_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmHWM:", 0) == 0) return std::stod(line.substr(6)) / 1024.0;
  }
  return std::nullopt;
}

}  // namespace

std::string scale_name(map::Scale scale) {
  switch (scale) {
    case map::Scale::kMetric:
      return "metric";
    case map::Scale::kUpToScale:
      return "up-to-scale";
    case map::Scale::kUnobservable:
      return "unobservable";
  }
  return "";
}

std::string trajectory_file(const std::string& stem, std::size_t part) {
  return part == 0 ? stem + ".tum" : stem + "_part" + std::to_string(part + 1) + ".tum";
}

RunRecord build_record(const RecordInput& input) {
  RunRecord record;
  record.version = BSLAM_VERSION;
  record.data = input.dataset.name;
  record.mode = mode_name(input);
  record.complete = input.complete;
  record.seed = static_cast<std::uint64_t>(input.config.seed);
  record.cameras_used = input.dataset.cameras_used;
  std::size_t next = 0;
  for (const InputFrame& in : input.inputs) {
    record.frames.push_back(frame_record(input, in, in.dropped ? nullptr : &input.system.frames()[next++]));
  }
  add_cameras(input, record);
  add_stages(input, record);
  const map::MapSnapshot map = input.system.snapshot();
  record.map = {static_cast<std::int64_t>(map->num_keyframes()),
                static_cast<std::int64_t>(map->num_landmarks()),
                static_cast<std::int64_t>(map->num_observations()),
                scale_name(map->scale()),
                input.loaded,
                {}};
  if (std::isfinite(map->scale_deviation()) && map->scale_deviation() > 0)
    record.map.scale_deviation = map->scale_deviation();
  record.maps_started = input.system.maps_started();
  add_places(input, record);
  record.start_up_s = input.start_up_s;
  record.wall_s = input.wall_s;
  record.peak_memory_mb = peak_memory_mb();
  return record;
}

}  // namespace bslam::session
