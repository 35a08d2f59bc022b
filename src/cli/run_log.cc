#include "cli/run_log.h"

#include <fmt/format.h>

#include <cstddef>
#include <cstdio>
#include <vector>

#include "report/summary.h"

namespace bslam::cli {
namespace {

std::string outcome_text(const report::FrameRecord& frame) {
  switch (frame.outcome) {
    case report::FrameOutcome::kTracked:
      return frame.keyframe ? "tracked, keyframe" : "tracked";
    case report::FrameOutcome::kLost:
      return "lost (" + frame.lost_reason + ")";
    case report::FrameOutcome::kDropped:
      break;
  }
  return "dropped";
}

}  // namespace

LogVerbosity log_verbosity(const std::string& name) {
  if (name == "error") return LogVerbosity::kError;
  if (name == "info") return LogVerbosity::kInfo;
  return name == "debug" ? LogVerbosity::kDebug : LogVerbosity::kWarning;
}

void print_stage_statistics(const report::RunRecord& record) {
  for (const report::StageSeries& stage : record.stages) {
    std::vector<double> durations_ms;
    for (const report::StageSample& sample : stage.samples) durations_ms.push_back(sample.ms);
    const report::DurationStatistics s = report::duration_statistics(std::move(durations_ms));
    if (s.count == 0) continue;
    fmt::print(stderr, "info: stage {}: {} calls, median {:.2f} ms, 95 % {:.2f} ms, maximum {:.2f} ms\n", stage.name,
               s.count, s.median, s.p95, s.max);
  }
}

void print_frames(const report::RunRecord& record) {
  for (std::size_t i = 0; i < record.frames.size(); ++i) {
    const report::FrameRecord& frame = record.frames[i];
    int inliers = 0;
    for (const report::CameraCounts& camera : frame.cameras) inliers += camera.inliers;
    fmt::print(stderr, "debug: frame {} at {:.3f} s: {}, {} inliers, {:.2f} ms\n", i, frame.time_s, outcome_text(frame),
               inliers, frame.frame_ms);
  }
}

}  // namespace bslam::cli
