// bslam bench --time: the times of one recording by stage, and its counted work, compared with earlier ones.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/option_table.h"
#include "base/vectorised.h"
#include "benchmark/time_comparison.h"
#include "cli/bench_runs.h"
#include "cli/interruption.h"
#include "cli/print_message.h"
#include "cli/shell_command.h"
#include "cli/verbs.h"
#include "cli/version.h"
#include "report/text_table.h"

namespace bslam::cli {
namespace {

namespace fs = std::filesystem;
using benchmark::TimeReport;
using Summary = nlohmann::ordered_json;

// Counts are equal in all runs of this mode only, so that it is the default of --time.
constexpr const char* kExactMode = "sequential";

// The result of a run: its summary, or the exit status of the benchmark.
struct TimedRun {
  Summary summary;
  int status = kExitOk;
};

Result<TimedRun> run_once(const BenchArguments& a, int run, const std::stop_token& stop) {
  const fs::path folder = fs::path(a.out) / fmt::format("run{}", run);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Error{folder.string(), "--out", error.message(), "a folder that can be created"};
  constexpr int kSeed = 1;
  std::vector<std::string> words = run_words(a, a.data.path, a.data.rig, folder, kSeed);
  words.insert(words.end(), {"--no-report", "--count-allocations"});
  const fs::path log = folder / "log.txt";
  const auto end = run_program(kThisProgram, words, log, stop);
  if (!end) return end.error();
  if (const std::string failure = failure_of(*end, log); !failure.empty()) {
    print_message("bslam: run {}: {}\n", run, failure);
    return TimedRun{{}, end->signal > 0 ? kExitFailed : end->exit_status};
  }
  const auto text = read_file(folder / "summary.json", kMaxLogBytes);
  if (!text) return text.error();
  Summary summary = Summary::parse(*text, nullptr, false);
  if (!summary.is_object())
    return Error{(folder / "summary.json").string(), "", "no JSON object", "the summary of a run"};
  return TimedRun{std::move(summary), kExitOk};
}

// The earlier figures, if some are given.
Result<std::optional<TimeReport>> read_earlier(const BenchArguments& a) {
  if (a.against.empty()) return std::optional<TimeReport>();
  const auto text = read_file(a.against, kMaxLogBytes);
  if (!text) return text.error();
  auto report = benchmark::parse_time_json(*text, a.against);
  if (!report) return report.error();
  if (report->conditions.mode != a.mode) return Error{a.against, "mode", report->conditions.mode, a.mode};
  return std::optional(*std::move(report));
}

benchmark::TimeConditions conditions_of(const BenchArguments& a, const std::string& data) {
  std::vector<std::string> words{"bslam", "bench", a.data.path, "--time", "--runs", std::to_string(a.runs)};
  if (!a.data.rig.empty()) words.insert(words.end(), {"--rig", a.data.rig});
  const auto options = run_options(a);
  words.insert(words.end(), options.begin(), options.end());
  return {.version = version_number(),
          .data = data,
          .mode = a.mode,
          .command = shell_command(words),
          .processor = processor_name(),
          .instructions = std::string(instruction_set())};
}

report::Document document_of(const TimeReport& report, const std::optional<benchmark::TimeComparison>& comparison,
                             double margin_percent) {
  const benchmark::TimeConditions& c = report.conditions;
  report::Document document{
      .title = fmt::format("Times of {}", c.data),
      .paragraphs = {fmt::format("bslam {}, mode {}, {} runs; {}, {}", c.version, c.mode, report.runs,
                                 c.processor.empty() ? "unknown processor" : c.processor, c.instructions),
                     c.command},
      .tables = benchmark::time_tables(report),
      .notes = {}};
  if (!comparison) return document;
  document.tables.push_back(benchmark::comparison_table(*comparison));
  document.notes = comparison->notes;
  document.notes.push_back(fmt::format(
      "MORE: more than {:g} % above the earlier median, and all runs above all earlier ones; DIFFERS: another count",
      margin_percent));
  return document;
}

void print(const report::Document& document) {
  for (const std::string& paragraph : document.paragraphs) fmt::print("{}\n", paragraph);
  for (const report::Table& table : document.tables) fmt::print("\n{}", report::text_table(table));
  if (!document.notes.empty()) fmt::print("\n");
  for (const std::string& note : document.notes) fmt::print("{}\n", note);
}

Status write_files(const TimeReport& report, const report::Document& document, const fs::path& folder) {
  if (const Status s = write_atomically(folder / "time.json", benchmark::time_json(report)); !s) return s;
  return write_document(document, folder);
}

// Runs the recording as often as requested. Returns the status of a run that failed, which ends it.
Result<int> run_all(const BenchArguments& a, const std::stop_token& stop, std::vector<Summary>& summaries) {
  for (int run = 1; run <= a.runs; ++run) {
    auto timed = run_once(a, run, stop);
    if (stop.stop_requested()) return kExitInterrupted;
    if (!timed) return timed.error();
    if (timed->status != kExitOk) return timed->status;
    summaries.push_back(std::move(timed->summary));
    print_message("run {} of {}: done\n", run, a.runs);
  }
  return kExitOk;
}

// The mode in which the recording is run: that of the options or settings, if they name one.
Result<std::string> mode_of(const BenchArguments& a) {
  if (!a.mode.empty()) return a.mode;
  system::Config exact;
  if (const Status s = OptionTable(exact).set("mode", kExactMode); !s) return s.error();
  auto config = resolve_config(a.config, exact);
  if (!config) return config.error();
  for (const auto& [value, name] : EnumNames<execution::Mode>::kNames) {
    if (value == config->mode) return std::string(name);
  }
  return std::string(kExactMode);
}

// The name of the recording, which must be readable.
Result<std::string> name_of_data(const BenchArguments& a) {
  const auto config = resolve_config(a.config);
  if (!config) return config.error();
  const auto request = dataset_request(a.data, config->io.sync_tolerance);
  if (!request) return request.error();
  const auto dataset = dataset::open_dataset(*request);
  if (!dataset) return dataset.error();
  return dataset->name;
}

int time_and_compare(const BenchArguments& a, const std::string& data, const std::optional<TimeReport>& earlier) {
  const Interruption interruption;
  std::vector<Summary> summaries;
  const auto status = run_all(a, interruption.token(), summaries);
  if (!status) return report_error(status.error());
  if (*status == kExitInterrupted) print_message("interrupted\n");
  if (*status != kExitOk) return *status;
  const TimeReport report = benchmark::make_time_report(conditions_of(a, data), summaries);
  std::optional<benchmark::TimeComparison> comparison;
  if (earlier) comparison = benchmark::compare_times(*earlier, report, 0.01 * a.margin_percent);
  const report::Document document = document_of(report, comparison, a.margin_percent);
  if (const Status s = write_files(report, document, a.out); !s) return report_error(s.error());
  print(document);
  return comparison && comparison->worse() ? kExitWorse : kExitOk;
}

}  // namespace

int bench_time(const BenchArguments& arguments) {
  BenchArguments a = arguments;
  const auto mode = mode_of(a);
  if (!mode) return report_error(mode.error());
  a.mode = *mode;
  const auto earlier = read_earlier(a);
  if (!earlier) return report_error(earlier.error());
  const auto data = name_of_data(a);
  if (!data) return report_error(data.error());
  if (*earlier && (*earlier)->conditions.data != *data)
    return report_error(Error{a.against, "data", (*earlier)->conditions.data, *data});
  if (const Status s = prepare_folder(a); !s) return report_error(s.error());
  return time_and_compare(a, *data, *earlier);
}

}  // namespace bslam::cli
