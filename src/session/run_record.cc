#include "session/run_record.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "base/median.h"

namespace bslam::session {

FrameOutcome RunFrame::outcome() const {
  if (!record) return FrameOutcome::kDropped;
  const bool tracked = record->final_result().status == tracking::TrackStatus::kTracking;
  return tracked ? FrameOutcome::kTracked : FrameOutcome::kLost;
}

bool CalibrationRecord::is_doubtful() const {
  return !pairs.empty() || !disagreeing.empty() || !unexplained.empty() || late || estimate.jump || estimate.unsteady;
}

void CalibrationRecord::accept_estimate(bool complete, bool in_map) {
  applies = complete && estimate.done && !estimate.implausible && !is_doubtful();
  replaced = in_map;
  refined = applies && replaced;
}

bool CalibrationRecord::foreign_images() const {
  return std::ranges::any_of(pairs, &calibration::CameraPair::contradicted);
}

calibration::Verdict CalibrationRecord::verdict() const {
  if (foreign_images()) return calibration::Verdict::kInconsistent;
  if (estimate.verdict != calibration::Verdict::kConsistent) return estimate.verdict;
  return is_doubtful() ? calibration::Verdict::kUnknown : estimate.verdict;
}

double MemoryReport::sum_mb() const {
  double sum = 0.0;
  for (const MemoryPart& part : parts) sum += part.mb;
  return sum;
}

std::int64_t count(const RunRecord& record, FrameOutcome outcome) {
  return std::ranges::count(record.frames, outcome, &RunFrame::outcome);
}

std::vector<CameraInterval> camera_intervals(std::span<const RunFrame> frames, std::size_t camera) {
  std::vector<CameraInterval> intervals;
  for (const RunFrame& frame : frames) {
    if (!frame.record) continue;
    const tracking::CameraStatus status = frame.record->cameras[camera];
    if (intervals.empty() || intervals.back().status != status)
      intervals.push_back({status, frame.time_s, frame.time_s});
    intervals.back().to_s = frame.time_s;
  }
  return intervals;
}

void add_stage_sample(RunRecord& record, std::string_view stage, StageThread thread, StageSample sample) {
  auto series = std::ranges::find(record.stages, stage, &StageSeries::name);
  if (series == record.stages.end()) {
    record.stages.push_back({.name = std::string(stage), .thread = thread});
    series = std::prev(record.stages.end());
  }
  series->samples.push_back(sample);
}

std::vector<LostInterval> lost_intervals(const RunRecord& record) {
  std::vector<LostInterval> intervals;
  bool open = false;
  for (const RunFrame& frame : record.frames) {
    if (!frame.record) continue;
    const bool lost = frame.outcome() == FrameOutcome::kLost;
    if (lost && !open) {
      const std::string_view reason = tracking::describe(frame.record->final_result().reason);
      intervals.push_back({frame.time_s, frame.time_s, std::string(reason)});
    }
    if (lost) intervals.back().to_s = frame.time_s;
    open = lost;
  }
  return intervals;
}

std::vector<ReducedInterval> reduced_intervals(const RunRecord& record) {
  std::vector<ReducedInterval> intervals;
  int level = 0;  // level of reduced work in the last frame
  for (const RunFrame& frame : record.frames) {
    if (!frame.record) continue;
    const bool begins = frame.record->reduction != level;
    level = frame.record->reduction;
    if (level == 0) continue;
    if (begins) intervals.push_back({.from_s = frame.time_s, .level = level});
    intervals.back().to_s = frame.time_s;
    ++intervals.back().frames;
  }
  return intervals;
}

std::vector<ContestedInterval> contested_intervals(const RunRecord& record) {
  std::vector<double> times_s;
  for (const RunFrame& frame : record.frames) {
    if (frame.record && frame.record->final_result().contest.contested) times_s.push_back(frame.time_s);
  }
  std::vector<ContestedInterval> intervals;
  std::size_t next = 0;  // the first frame that belongs to no interval yet
  for (std::size_t last = tracking::kContestedFrames - 1; last < times_s.size(); ++last) {
    const std::size_t first = last + 1 - tracking::kContestedFrames;
    if (times_s[last] - times_s[first] > tracking::kContestedWithin_s) continue;
    if (intervals.empty() || next <= first) intervals.push_back({.from_s = times_s[first]});
    intervals.back().frames += static_cast<std::int64_t>(last + 1 - std::max(next, first));
    intervals.back().to_s = times_s[last];
    next = last + 1;
  }
  return intervals;
}

bool never_started(const RunRecord& record) {
  const auto had_images = [](const RunFrame& frame) {
    return frame.record && frame.record->final_result().reason == tracking::LostReason::kNotStarted;
  };
  return record.maps_started == 0 && !record.map.loaded && record.cameras.size() > 1 &&
         std::ranges::any_of(record.frames, had_images);
}

bool mostly_lost(const RunRecord& record) {
  if (record.cameras.size() < 2 || record.map.loaded) return false;
  const auto unexplained = [](const RunFrame& frame) {
    if (frame.outcome() != FrameOutcome::kLost) return false;
    const tracking::LostReason reason = frame.record->final_result().reason;
    return reason != tracking::LostReason::kNoImages && reason != tracking::LostReason::kFewFeatures;
  };
  return std::ranges::count_if(record.frames, unexplained) > count(record, FrameOutcome::kTracked);
}

bool ended_at_once(const RunRecord& record) { return record.frames.empty(); }

std::int64_t frames_in_loaded_map(const RunRecord& record) {
  std::int64_t frames = 0;
  for (const SubmapRecord& submap : record.submaps) frames += submap.loaded ? submap.frames : 0;
  return frames;
}

std::optional<double> inlier_share(const RunRecord& record, std::size_t camera) {
  std::int64_t matched = 0, inliers = 0;
  for (const RunFrame& frame : record.frames) {
    if (frame.outcome() != FrameOutcome::kTracked || camera >= frame.record->final_result().cameras.size()) continue;
    matched += frame.record->final_result().cameras[camera].matched;
    inliers += frame.record->final_result().cameras[camera].inliers;
  }
  if (matched == 0) return std::nullopt;
  return static_cast<double>(inliers) / static_cast<double>(matched);
}

namespace {

// The median of the values of all cameras but one; 0 without others.
double median_of_others(std::vector<double> values, std::size_t camera) {
  values.erase(values.begin() + static_cast<std::ptrdiff_t>(camera));
  std::erase(values, 0.0);
  return values.empty() ? 0.0 : lower_median(std::move(values));
}

}  // namespace

std::vector<std::size_t> unexplained_cameras(const RunRecord& record) {
  constexpr double kMoreError = 2, kFewerInliers = 0.9;
  constexpr std::size_t kMinObservations = 200;
  std::vector<double> rms_px(record.cameras.size(), 0), shares(record.cameras.size(), 0);
  for (std::size_t c = 0; c < record.cameras.size(); ++c) {
    const auto share = inlier_share(record, c);
    if (record.cameras[c].residuals.observations < kMinObservations || !share) continue;
    rms_px[c] = record.cameras[c].residuals.rms_px;
    shares[c] = *share;
  }
  std::vector<std::size_t> out;
  for (std::size_t c = 0; c < record.cameras.size(); ++c) {
    const double of_others = median_of_others(rms_px, c);
    if (of_others > 0 && rms_px[c] > kMoreError * of_others && shares[c] < kFewerInliers * median_of_others(shares, c))
      out.push_back(c);
  }
  return out;
}

}  // namespace bslam::session
