// The times and the counted work of a recording that was run several times, and their file, time.json.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "report/document.h"

namespace bslam::benchmark {

// A figure of several runs.
struct Spread {
  double median = 0, min = 0, max = 0;
  friend bool operator==(const Spread&, const Spread&) = default;
};

Spread spread_of(std::vector<double> values);  // `values` must not be empty

struct StageTimes {
  std::string name;
  std::optional<std::int64_t> calls;  // nullopt if they differ between the runs
  Spread median_ms, p95_ms, total_ms;
  friend bool operator==(const StageTimes&, const StageTimes&) = default;
};

// A count that differs between the runs.
struct VaryingCount {
  std::string name;
  std::int64_t min = 0, max = 0;
  friend bool operator==(const VaryingCount&, const VaryingCount&) = default;
};

struct TimeConditions {
  std::string version, data, mode, command;
  std::string processor, instructions;  // name of the processor (empty if unknown), and the vector instructions in use
  friend bool operator==(const TimeConditions&, const TimeConditions&) = default;
};

struct TimeReport {
  TimeConditions conditions;
  int runs = 0;
  std::vector<std::pair<std::string, Spread>> process;  // figures of the whole process by name, which contains the unit
  std::vector<StageTimes> stages;                       // by decreasing total time
  std::vector<std::pair<std::string, std::int64_t>> work;  // counts that are equal in all runs
  std::vector<VaryingCount> varying;
  friend bool operator==(const TimeReport&, const TimeReport&) = default;
};

// Builds the report from the summaries (session/summary.h) of one or more complete runs.
TimeReport make_time_report(const TimeConditions& conditions, std::span<const nlohmann::ordered_json> summaries);

// The content of time.json.
std::string time_json(const TimeReport& report);

// Parses time.json. Errors name the key of a value that is missing or has the wrong type; `file` is the name used in
// errors.
Result<TimeReport> parse_time_json(const std::string& text, const std::string& file);

// Tables of the process, the stages and the work.
std::vector<report::Table> time_tables(const TimeReport& report);

// Text for a figure's name: "peak memory MB" for "peak_memory_mb".
std::string spoken(std::string name);

}  // namespace bslam::benchmark
