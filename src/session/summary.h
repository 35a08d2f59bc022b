// summary.json of a run (schema 1).
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "session/run_record.h"

namespace bslam::session {

// Order statistics of durations in ms, all NaN if there are no samples. Percentiles between two samples are
// interpolated linearly, as in numpy.percentile.
struct DurationStatistics {
  double median = 0.0, p95 = 0.0, max = 0.0;
  std::size_t count = 0;
};

DurationStatistics duration_statistics(std::vector<double> durations_ms);

// Returns the summary, with keys in the order documented in docs/cli.md. The key `parts` lists the submaps. Frame
// counts, lost intervals, mean feature counts and time statistics are computed here from the record. Features are
// averaged over the processed frames, keypoints over the images of these frames. A value that was not measured is null.
nlohmann::ordered_json summary_json(const RunRecord& record);

// Returns the content of the file: indented, with a final newline. Bytes that are not UTF-8 are replaced.
std::string summary_text(const RunRecord& record);

}  // namespace bslam::session
