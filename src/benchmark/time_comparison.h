// Compares the times and the counted work of a recording with those that were measured before.
#pragma once

#include <string>
#include <vector>

#include "benchmark/time_report.h"

namespace bslam::benchmark {

enum class Change {
  kNone,
  kLess,     // less time or memory
  kMore,     // more time or memory
  kDiffers,  // a count differs; counts must be equal
};

struct ComparedFigure {
  std::string name;
  std::string before, now;  // "-" if it was not measured
  std::string ratio;        // now to before
  Change change = Change::kNone;
};

struct TimeComparison {
  std::vector<ComparedFigure> figures;
  // Differences in the conditions, such as another processor, that make the times incomparable.
  std::vector<std::string> notes;
  bool worse() const;  // a count differs, or a time or memory has increased
};

// A time or memory has increased if its median is larger than the earlier one by more than the fraction `margin` and by
// more than measurement noise, and if the value of every new run is larger than that of every earlier run. Counts are
// compared if both were measured in sequential mode and were equal in all runs.
TimeComparison compare_times(const TimeReport& before, const TimeReport& now, double margin);

report::Table comparison_table(const TimeComparison& comparison);

}  // namespace bslam::benchmark
