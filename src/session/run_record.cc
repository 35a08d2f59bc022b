#include "report/run_record.h"

#include <algorithm>
#include <iterator>

namespace bslam::report {

void add_stage_sample(RunRecord& record, std::string_view stage, StagePlace place, StageSample sample) {
  auto series = std::ranges::find(record.stages, stage, &StageSeries::name);
  if (series == record.stages.end()) {
    record.stages.push_back({.name = std::string(stage), .place = place});
    series = std::prev(record.stages.end());
  }
  series->samples.push_back(sample);
}

std::vector<LostInterval> lost_intervals(const RunRecord& record) {
  std::vector<LostInterval> intervals;
  bool open = false;
  for (const FrameRecord& frame : record.frames) {
    if (frame.outcome == FrameOutcome::kDropped) continue;
    const bool lost = frame.outcome == FrameOutcome::kLost;
    if (lost && !open) intervals.push_back({frame.time_s, frame.time_s, frame.lost_reason});
    if (lost) intervals.back().to_s = frame.time_s;
    open = lost;
  }
  return intervals;
}

}  // namespace bslam::report
