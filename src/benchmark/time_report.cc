#include "benchmark/time_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/median.h"

namespace bslam::benchmark {
namespace {

using json = nlohmann::ordered_json;

std::optional<double> number(const json& summary, const json::json_pointer& at) {
  if (!summary.contains(at) || !summary.at(at).is_number()) return std::nullopt;
  return summary.at(at).get<double>();
}

// The figure under a key of all summaries, or nullopt if a summary does not have it.
std::optional<Spread> spread_at(std::span<const json> summaries, const json::json_pointer& at, double scale = 1.0) {
  std::vector<double> values;
  for (const json& summary : summaries) {
    const auto value = number(summary, at);
    if (!value) return std::nullopt;
    values.push_back(*value * scale);
  }
  return spread_of(std::move(values));
}

void add_process(std::span<const json> summaries, TimeReport& report) {
  const auto add = [&](const char* name, const std::optional<Spread>& value) {
    if (value) report.process.emplace_back(name, *value);
  };
  const auto at = [](const char* pointer) { return json::json_pointer(pointer); };
  const double frames = std::max(1.0, number(summaries.front(), at("/work/frames")).value_or(1.0));
  add("frame_wall_median_ms", spread_at(summaries, at("/time/frame_ms/median")));
  add("frame_wall_p95_ms", spread_at(summaries, at("/time/frame_ms/p95")));
  add("frame_cpu_mean_ms", spread_at(summaries, at("/time/cpu_s"), 1e3 / frames));
  add("run_wall_s", spread_at(summaries, at("/time/wall_s")));
  add("run_cpu_s", spread_at(summaries, at("/time/cpu_s")));
  add("peak_memory_mb", spread_at(summaries, at("/memory/peak_mb")));
  add("allocations_per_frame", spread_at(summaries, at("/work/allocations"), 1.0 / frames));
}

void add_stages(std::span<const json> summaries, TimeReport& report) {
  const json::json_pointer stages("/time/stages_ms");
  if (!summaries.front().contains(stages)) return;
  for (const auto& [name, value] : summaries.front().at(stages).items()) {
    const auto median = spread_at(summaries, stages / name / "median"),
               p95 = spread_at(summaries, stages / name / "p95"), total = spread_at(summaries, stages / name / "total"),
               calls = spread_at(summaries, stages / name / "count");
    if (!median || !p95 || !total || !calls) continue;  // some run has no such stage
    StageTimes stage{name, {}, *median, *p95, *total};
    if (calls->min == calls->max) stage.calls = static_cast<std::int64_t>(calls->median);
    report.stages.push_back(std::move(stage));
  }
  std::ranges::stable_sort(report.stages, std::ranges::greater(),
                           [](const StageTimes& s) { return s.total_ms.median; });
}

void add_work(std::span<const json> summaries, TimeReport& report) {
  const json::json_pointer work("/work");
  if (!summaries.front().contains(work)) return;
  for (const auto& [name, value] : summaries.front().at(work).items()) {
    const auto counts = spread_at(summaries, work / name);
    if (!counts) continue;
    const auto min = static_cast<std::int64_t>(counts->min), max = static_cast<std::int64_t>(counts->max);
    if (min == max) {
      report.work.emplace_back(name, min);
    } else {
      report.varying.push_back({name, min, max});
    }
  }
}

std::string spread_text(const Spread& s, int decimals) {
  if (s.min == s.max) return "";
  return fmt::format("{:.{}f} - {:.{}f}", s.min, decimals, s.max, decimals);
}

}  // namespace

Spread spread_of(std::vector<double> values) {
  const auto [min, max] = std::ranges::minmax(values);
  return {0.5 * (lower_median(values) + median(values)), min, max};
}

TimeReport make_time_report(const TimeConditions& conditions, std::span<const json> summaries) {
  TimeReport report;
  report.conditions = conditions;
  report.runs = static_cast<int>(summaries.size());
  if (summaries.empty()) return report;
  add_process(summaries, report);
  add_stages(summaries, report);
  add_work(summaries, report);
  return report;
}

std::string spoken(std::string name) {
  std::ranges::replace(name, '_', ' ');
  if (name.ends_with(" mb")) name.replace(name.size() - 2, 2, "MB");
  return name;
}

std::vector<report::Table> time_tables(const TimeReport& report) {
  report::Table process{"process", {"figure", "median", "range over the runs"}, {}};
  for (const auto& [name, value] : report.process)
    process.rows.push_back({spoken(name), fmt::format("{:.2f}", value.median), spread_text(value, 2)});
  report::Table stages{"stages", {"stage", "calls", "median ms", "95 % ms", "total ms", "range of the median"}, {}};
  for (const StageTimes& s : report.stages)
    stages.rows.push_back({s.name, s.calls ? std::to_string(*s.calls) : "varies",
                           fmt::format("{:.3f}", s.median_ms.median), fmt::format("{:.3f}", s.p95_ms.median),
                           fmt::format("{:.1f}", s.total_ms.median), spread_text(s.median_ms, 3)});
  report::Table work{"counted work", {"count", "value"}, {}};
  for (const auto& [name, value] : report.work) work.rows.push_back({spoken(name), std::to_string(value)});
  for (const VaryingCount& v : report.varying)
    work.rows.push_back({spoken(v.name), fmt::format("{} - {} (differs between the runs)", v.min, v.max)});
  return {process, stages, work};
}

}  // namespace bslam::benchmark
