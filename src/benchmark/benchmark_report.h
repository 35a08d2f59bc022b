// The report of a benchmark: results of each sequence, published errors, and all runs.
#pragma once

#include <string>
#include <vector>

#include "benchmark/measure_run.h"
#include "report/document.h"

namespace bslam::benchmark {

struct SequenceResult {
  Sequence sequence;
  std::vector<RunMeasurement> runs;  // finished runs
  // The first two runs of a deterministic mode gave the same trajectory: their seeds had no effect, and further runs,
  // which would be copies, were left out.
  bool identical = false;
};

struct BenchmarkConditions {
  std::string version;    // version of the program
  std::string processor;  // empty if unknown
  std::string command;
  int runs = 1;          // requested for each sequence
  bool partial = false;  // the options select a part of each sequence, so that published errors are not comparable
  bool loops = true;     // loops are closed
  bool complete = true;  // false: interrupted, or still running
};

// Returns the report. Errors are medians over the runs, with the best and the worst run.
report::Document benchmark_report(const std::vector<SequenceResult>& results, const BenchmarkConditions& conditions);

}  // namespace bslam::benchmark
