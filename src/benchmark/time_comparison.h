// Compares the times and the counted work of a recording with those that were measured before.
#pragma once

#include <string>
#include <vector>

#include "benchmark/time_report.h"

namespace bslam::benchmark {

enum class Change {
  kNone,
  kFaster,
  kSlower,   // or more memory
  kDiffers,  // a count; it has no other tolerance than equality
};

struct ComparedFigure {
  std::string name;
  std::string before, now;  // "-" if it was not measured
  std::string ratio;        // now to before
  Change change = Change::kNone;
};

struct TimeComparison {
  std::vector<ComparedFigure> figures;
  std::vector<std::string> notes;  // differences of the conditions that make times incomparable
  bool worse() const;              // a count differs, or a time is slower
};

// A time is slower if its median is larger than that before by more than the fraction `margin` and by more than the
// clock and the scheduler change it by chance, and all runs are slower than all before. Counts are compared if
// both were measured in sequential mode and were equal in all runs.
TimeComparison compare_times(const TimeReport& before, const TimeReport& now, double margin);

report::Table comparison_table(const TimeComparison& comparison);

}  // namespace bslam::benchmark
