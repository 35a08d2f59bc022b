#include "cli/run_log.h"

#include <fmt/format.h>

#include <cstddef>
#include <vector>

#include "cli/print_message.h"
#include "session/summary.h"

namespace bslam::cli {
namespace {

std::string outcome_text(const session::RunFrame& frame) {
  switch (frame.outcome()) {
    case session::FrameOutcome::kTracked:
      return frame.record->keyframe ? "tracked, keyframe" : "tracked";
    case session::FrameOutcome::kLost:
      return fmt::format("lost ({})", tracking::describe(frame.record->final_result().reason));
    case session::FrameOutcome::kDropped:
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

void print_stage_statistics(const session::RunRecord& record) {
  for (const session::StageSeries& stage : record.stages) {
    std::vector<double> durations_ms;
    for (const session::StageSample& sample : stage.samples) durations_ms.push_back(sample.ms);
    const session::DurationStatistics s = session::duration_statistics(std::move(durations_ms));
    if (s.count == 0) continue;
    print_message("info: stage {}: {} calls, median {:.2f} ms, 95 % {:.2f} ms, maximum {:.2f} ms\n", stage.name,
                  s.count, s.median, s.p95, s.max);
  }
}

void print_frames(const session::RunRecord& record) {
  for (std::size_t i = 0; i < record.frames.size(); ++i) {
    const session::RunFrame& frame = record.frames[i];
    int inliers = 0;
    double frame_ms = 0;
    if (frame.record) {
      for (const tracking::CameraCounts& camera : frame.record->final_result().cameras) inliers += camera.inliers;
      frame_ms = frame.record->frame_ms;
    }
    print_message("debug: frame {} at {:.3f} s: {}, {} inliers, {:.2f} ms\n", i, frame.time_s, outcome_text(frame),
                  inliers, frame_ms);
  }
}

}  // namespace bslam::cli
