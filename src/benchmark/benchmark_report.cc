#include "benchmark/benchmark_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "benchmark/published_figures.h"

namespace bslam::benchmark {
namespace {

using Figure = std::function<std::optional<double>(const RunMeasurement&)>;

// The values of a figure in all runs that have it, sorted.
std::vector<double> values(const std::vector<RunMeasurement>& runs, const Figure& figure) {
  std::vector<double> sorted;
  for (const RunMeasurement& run : runs) {
    if (const auto value = figure(run)) sorted.push_back(*value);
  }
  std::ranges::sort(sorted);
  return sorted;
}

double median(const std::vector<double>& sorted) {
  const std::size_t half = sorted.size() / 2;
  return sorted.size() % 2 == 1 ? sorted[half] : 0.5 * (sorted[half - 1] + sorted[half]);
}

std::string median_text(const std::vector<RunMeasurement>& runs, const Figure& figure, int decimals) {
  const auto sorted = values(runs, figure);
  return sorted.empty() ? "-" : fmt::format("{:.{}f}", median(sorted), decimals);
}

// Text with median, best, worst and mean; only the value if there is one.
std::string spread_text(const std::vector<RunMeasurement>& runs, const Figure& figure) {
  const auto sorted = values(runs, figure);
  if (sorted.empty()) return "-";
  if (sorted.front() == sorted.back()) return fmt::format("{:.4f}", sorted.front());
  double sum = 0.0;
  for (const double v : sorted) sum += v;
  return fmt::format("{:.4f} ({:.4f} - {:.4f}, mean {:.4f})", median(sorted), sorted.front(), sorted.back(),
                     sum / static_cast<double>(sorted.size()));
}

std::string number(std::optional<double> value, int decimals) {
  return value ? fmt::format("{:.{}f}", *value, decimals) : "-";
}

std::optional<double> coverage_percent(const RunMeasurement& run) {
  if (run.frames == 0) return std::nullopt;
  return 100.0 * run.frames_with_pose / run.frames;
}

std::string truth_text(const Sequence& sequence) {
  if (sequence.corrected) return sequence.released ? "body; T: groundtruth_body.tum" : "groundtruth_body.tum";
  if (!sequence.released) return "none: no errors";
  return sequence.released->frame == TruthFrame::kBody ? "body" : "camera 0";
}

std::string remark(const SequenceResult& result) {
  if (result.identical) return "deterministic: the first two runs are identical, others were left out";
  const auto failed = std::ranges::count_if(result.runs, [](const auto& run) { return !run.failure.empty(); });
  if (failed > 0) {
    const auto first = std::ranges::find_if(result.runs, [](const auto& run) { return !run.failure.empty(); });
    return fmt::format("{} of {} runs failed: {}", failed, result.runs.size(), first->failure);
  }
  for (const RunMeasurement& run : result.runs) {
    if (!run.truth_problem.empty()) return "no errors: " + run.truth_problem;
  }
  const auto split = std::ranges::find_if(result.runs, [](const auto& run) { return run.submaps > 1; });
  if (split != result.runs.end()) {
    return fmt::format("run {} ended with {} submaps; errors are of the largest", split->run, split->submaps);
  }
  if (std::ranges::any_of(result.runs, &RunMeasurement::body_is_camera))
    return "the calibration gives camera 0 no pose on the body other than the identity: the body is taken to be camera "
           "0";
  if (const auto contradicted = std::ranges::count_if(result.runs, &RunMeasurement::contradicted); contradicted > 0)
    return fmt::format("the images contradict the calibration in {} of {} runs; see their log.txt", contradicted,
                       result.runs.size());
  return "";
}

report::Table result_table(const std::vector<SequenceResult>& results) {
  report::Table table{
      "Results",
      {"sequence", "ground truth", "runs", "P [m]", "T [m]", "T, poses during the run [m]",
       "frames with a pose, worst run [%]", "time per frame, median / 95 % [ms]", "peak memory [MB]", "remark"},
      {}};
  for (const SequenceResult& r : results) {
    const auto covered = values(r.runs, coverage_percent);
    table.rows.push_back({r.sequence.name, truth_text(r.sequence), std::to_string(r.runs.size()),
                          spread_text(r.runs, &RunMeasurement::ate_p_m), spread_text(r.runs, &RunMeasurement::ate_t_m),
                          spread_text(r.runs, &RunMeasurement::ate_t_live_m),
                          covered.empty() ? "-" : fmt::format("{:.1f}", covered[0]),
                          median_text(r.runs, &RunMeasurement::frame_ms_median, 1) + " / " +
                              median_text(r.runs, &RunMeasurement::frame_ms_p95, 1),
                          median_text(r.runs, &RunMeasurement::peak_mb, 0), remark(r)});
  }
  return table;
}

// Adds the published errors and collects their sources.
void add_published(const std::vector<SequenceResult>& results, report::Document& document) {
  report::Table table{"Published errors", {"sequence", "protocol", "system", "error [m]", "bslam, median [m]"}, {}};
  std::vector<std::string> sources;
  for (const SequenceResult& r : results) {
    for (const PublishedFigure& f : published_figures(r.sequence.name)) {
      const bool p = f.row->protocol == Protocol::kP;
      const auto ours = p ? &RunMeasurement::ate_p_m : &RunMeasurement::ate_t_m;
      table.rows.push_back({r.sequence.name, p ? "P" : "T", std::string(f.row->system), fmt::format("{:.3f}", f.ate_m),
                            median_text(r.runs, ours, 4)});
      std::string source = fmt::format("{} ({}): {}{}", f.row->system, p ? "P" : "T", f.row->source,
                                       f.row->checked ? "" : "; not checked against the source: do so before citing");
      if (std::ranges::find(sources, source) == sources.end()) sources.push_back(std::move(source));
    }
  }
  if (table.rows.empty()) return;
  document.tables.push_back(std::move(table));
  document.notes.insert(document.notes.end(), sources.begin(), sources.end());
}

report::Table run_table(const std::vector<SequenceResult>& results) {
  report::Table table{"All runs",
                      {"sequence", "run", "P [m]", "T [m]", "T, poses during the run [m]", "frames with a pose",
                       "submaps", "loops", "time per frame, median / 95 % [ms]", "peak memory [MB]", "failure"},
                      {}};
  for (const SequenceResult& r : results) {
    for (const RunMeasurement& m : r.runs) {
      table.rows.push_back({r.sequence.name, std::to_string(m.run), number(m.ate_p_m, 4), number(m.ate_t_m, 4),
                            number(m.ate_t_live_m, 4), fmt::format("{} of {}", m.frames_with_pose, m.frames),
                            std::to_string(m.submaps), std::to_string(m.loops),
                            number(m.frame_ms_median, 1) + " / " + number(m.frame_ms_p95, 1), number(m.peak_mb, 0),
                            m.failure});
    }
  }
  return table;
}

}  // namespace

report::Document benchmark_report(const std::vector<SequenceResult>& results, const BenchmarkConditions& conditions) {
  report::Document document{.title = "bslam bench", .paragraphs = {}, .tables = {}, .notes = {}};
  if (!conditions.complete) document.paragraphs.push_back("Not complete: the runs that have ended so far.");
  document.paragraphs.push_back(
      fmt::format("{}{}; {} of each sequence, with seeds from 1; loop closing {}. Command: {}", conditions.version,
                  conditions.processor.empty() ? "" : ", " + conditions.processor,
                  conditions.runs == 1 ? "1 run" : fmt::format("{} runs", conditions.runs),
                  conditions.loops ? "on" : "off", conditions.command));
  document.tables.push_back(result_table(results));
  document.notes = {
      "Errors are RMSE of the positions after rigid alignment, over all frames with a pose: median (best - worst, "
      "mean) "
      "of the runs. Systems that lose many frames look better than they are.",
      "P: path of camera 0 against the released poses of the body, without the camera's position on the body. The "
      "error "
      "of a perfect path is some centimetres.",
      "T: path of the camera moved to the body with the calibration, against groundtruth_body.tum if the sequence "
      "contains it, otherwise against the released poses; a path of camera 0 is compared directly. The released "
      "orientation of EuRoC V1_01 is wrong by 5.5 degrees: compare it with recomputed poses.",
      "T, poses during the run: the same for the poses as they were reported at each frame."};
  if (!conditions.partial) add_published(results, document);
  document.tables.push_back(run_table(results));
  return document;
}

}  // namespace bslam::benchmark
