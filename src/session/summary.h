// summary.json of a run (schema 1).
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "session/run_record.h"

namespace bslam::session {

// Order statistics of durations in ms; all NaN where there is none. A share between two samples is interpolated
// linearly (as numpy.percentile does).
struct DurationStatistics {
  double median = 0.0, p95 = 0.0, max = 0.0;
  std::size_t count = 0;
};

DurationStatistics duration_statistics(std::vector<double> durations_ms);

// The summary, keys in the order of the contract. Counts of frames, lost intervals, means of features (over the frames
// handed to the tracker; keypoints over the images in them) and statistics of times are made here from the record. A
// figure without a measurement is null.
nlohmann::ordered_json summary_json(const RunRecord& record);

// The bytes of the file: indented, with a final newline; text that is not UTF-8 is replaced.
std::string summary_text(const RunRecord& record);

}  // namespace bslam::session
