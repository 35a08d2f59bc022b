// bslam bench: runs the SLAM system on all sequences of a folder and writes a table of the results.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/atomic_file.h"
#include "base/option_table.h"
#include "benchmark/benchmark_report.h"
#include "cli/bench_runs.h"
#include "cli/interruption.h"
#include "cli/print_message.h"
#include "cli/shell_command.h"
#include "cli/verbs.h"
#include "cli/version.h"

namespace bslam::cli {
namespace {

namespace fs = std::filesystem;
using benchmark::RunMeasurement;
using benchmark::Sequence;
using benchmark::SequenceResult;

std::string rig_of(const BenchArguments& a, const Sequence& sequence) {
  if (!a.data.rig.empty()) return a.data.rig;
  return sequence.rig ? sequence.rig->string() : "";
}

// Returns the calibrated pose of the run's camera 0 in the body.
Result<geometry::SE3> body_from_camera(const BenchArguments& a, const Sequence& sequence) {
  DatasetArguments data = a.data;
  data.path = sequence.folder.string();
  data.rig = rig_of(a, sequence);
  const auto config = resolve_config(a.config);
  if (!config) return config.error();
  const auto request = dataset_request(data, config->io.sync_tolerance);
  if (!request) return request.error();
  const auto dataset = dataset::open_dataset(*request);
  if (!dataset) return dataset.error();
  return dataset->rig.body_from_rig();
}

// The result of one run, and the exit status of the benchmark that follows from it.
struct RunOutcome {
  RunMeasurement measurement;
  int status = kExitOk;
};

Result<RunMeasurement> measured(const BenchArguments& a, const Sequence& sequence, const fs::path& folder) {
  const auto pose = body_from_camera(a, sequence);
  if (!pose) return pose.error();
  return benchmark::measure_run(folder, sequence, *pose);
}

// Runs a sequence in a separate process, so that its peak memory is measured separately and a crash ends only this run.
RunOutcome run_sequence(const BenchArguments& a, const Sequence& sequence, int run, const std::stop_token& stop) {
  const fs::path folder = fs::path(a.out) / sequence.name / fmt::format("run{}", run);
  const auto failed = [run](std::string message, int status) {
    RunOutcome outcome{.measurement = {}, .status = status};
    outcome.measurement.run = run;
    outcome.measurement.failure = std::move(message);
    return outcome;
  };
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return failed(folder.string() + ": " + error.message(), kExitBadInput);
  const auto words = run_words(a, sequence.folder.string(), rig_of(a, sequence), folder, run);
  const fs::path log = folder / "log.txt";
  const auto end = run_program(kThisProgram, words, log, stop);
  if (!end) return failed(end.error().message(), kExitFailed);
  std::string failure = failure_of(*end, log);
  const int status = end->signal > 0 ? kExitFailed : end->exit_status;
  if (status != kExitOk && status != kExitNothingTracked) return failed(std::move(failure), status);
  auto measurement = measured(a, sequence, folder);
  if (!measurement) return failed(measurement.error().message(), kExitBadInput);
  measurement->run = run;
  measurement->failure = std::move(failure);
  return {*std::move(measurement), status};
}

Status write_report(const std::vector<SequenceResult>& results, const benchmark::BenchmarkConditions& conditions,
                    const fs::path& folder) {
  return write_document(benchmark::benchmark_report(results, conditions), folder);
}

benchmark::BenchmarkConditions conditions_of(const BenchArguments& a, bool loops) {
  std::vector<std::string> words{"bslam", "bench", a.data.path, "--runs", std::to_string(a.runs)};
  if (!a.data.rig.empty()) words.insert(words.end(), {"--rig", a.data.rig});
  const auto options = run_options(a);
  words.insert(words.end(), options.begin(), options.end());
  const std::string version = version_text();
  return {.version = version.substr(0, version.find('\n')),
          .processor = processor_name(),
          .command = shell_command(words),
          .runs = a.runs,
          .partial = a.data.begin_s || a.data.end_s,
          .loops = loops && !a.no_loop,
          .complete = false};
}

// Returns true if two runs in a deterministic mode gave the same poses. Then their seeds had no effect: random numbers
// are only drawn for monocular initialisation, if tracking is difficult or lost, and to verify recognised places.
bool are_copies(const BenchArguments& a, const Sequence& sequence, execution::Mode mode) {
  if (mode == execution::Mode::kParallel) return false;
  const auto trajectory = [&](const char* run) {
    return read_file(fs::path(a.out) / sequence.name / run / "trajectory.tum", kMaxLogBytes);
  };
  const auto first = trajectory("run1"), second = trajectory("run2");
  return first && second && *first == *second;
}

// Runs a sequence as often as requested, but stops if the runs are identical.
Result<int> run_repeatedly(const BenchArguments& a, const Sequence& sequence, execution::Mode mode,
                           const std::stop_token& stop, SequenceResult& result, const std::function<Status()>& write) {
  int status = kExitOk;
  for (int run = 1; run <= a.runs && !result.identical; ++run) {
    if (stop.stop_requested()) return kExitInterrupted;
    const RunOutcome outcome = run_sequence(a, sequence, run, stop);
    if (stop.stop_requested() && !outcome.measurement.failure.empty()) return kExitInterrupted;
    result.runs.push_back(outcome.measurement);
    if (status == kExitOk) status = outcome.status;
    print_message("{}, run {}: {}\n", sequence.name, run,
                  outcome.measurement.failure.empty() ? "done" : outcome.measurement.failure);
    result.identical = run == 2 && a.runs > 2 && status == kExitOk && are_copies(a, sequence, mode);
    if (result.identical)
      print_message("{}: both runs are identical, since this mode is deterministic; no further runs are made\n",
                    sequence.name);
    if (const Status s = write(); !s) return s.error();
  }
  return status;
}

// Runs everything; writes the report after every run. Returns the status of the first run that failed.
Result<int> run_all(const BenchArguments& a, const std::vector<Sequence>& sequences, execution::Mode mode,
                    benchmark::BenchmarkConditions conditions, const std::stop_token& stop) {
  std::vector<SequenceResult> results;
  int status = kExitOk;
  if (const Status s = write_report(results, conditions, a.out); !s) return s.error();
  for (const Sequence& sequence : sequences) {
    results.push_back({sequence, {}});
    const auto ended = run_repeatedly(a, sequence, mode, stop, results.back(),
                                      [&] { return write_report(results, conditions, a.out); });
    if (!ended || *ended == kExitInterrupted) return ended;
    if (status == kExitOk) status = *ended;
  }
  conditions.complete = true;
  if (const Status s = write_report(results, conditions, a.out); !s) return s.error();
  return status;
}

int bench(const BenchArguments& a) {
  if (a.time) return bench_time(a);
  const Interruption interruption;
  auto config = resolve_config(a.config);
  if (!config) return report_error(config.error());
  if (!a.mode.empty()) {
    if (const Status s = OptionTable(*config).set("mode", a.mode); !s) return report_error(s.error());
  }
  if (const auto request = dataset_request(a.data, 0.0); !request) return report_error(request.error());
  const auto sequences = benchmark::find_sequences(a.data.path);
  if (!sequences) return report_error(sequences.error());
  if (const Status s = prepare_folder(a); !s) return report_error(s.error());
  const auto conditions = conditions_of(a, config->looping.loop.enabled);
  const auto status = run_all(a, *sequences, config->mode, conditions, interruption.token());
  if (!status) return report_error(status.error());
  if (*status == kExitInterrupted) print_message("interrupted\n");
  if (const auto text = read_file(fs::path(a.out) / "report.md", kMaxLogBytes)) {
    std::fwrite(text->data(), 1, text->size(), stdout);
  }
  return *status;
}

void add_run_options(CLI::App& verb, BenchArguments& a) {
  add_config_options(verb, a.config);
  verb.add_option("--mode", a.mode, "sequential, lagged or parallel (default)")
      ->check(CLI::IsMember({"sequential", "lagged", "parallel"}));
  verb.add_option("--pace", a.pace, "fast (default) or realtime")->check(CLI::IsMember({"fast", "realtime"}));
  verb.add_option("--late", a.late, "block (default) or drop")->check(CLI::IsMember({"block", "drop"}));
  verb.add_option("--vocabulary", a.vocabulary, "vocabulary for place recognition");
  verb.add_flag("--no-loop", a.no_loop, "disable loop closing");
  verb.add_flag("--no-final-ba", a.no_final_ba, "skip the global bundle adjustment at the end");
}

}  // namespace

void add_bench(CLI::App& app, int& exit_status) {
  const auto a = std::make_shared<BenchArguments>();
  CLI::App* verb = app.add_subcommand(
      "bench",
      "run all EuRoC, TUM-VI or KITTI sequences of a folder and write a table of errors, time and memory, or time one "
      "recording by stage");
  add_dataset_options(*verb, a->data);
  verb->get_option("DATA")->description("folder of the sequences, or one sequence");
  verb->add_option("--out", a->out, "folder for report.md, report.html and the files of every run")
      ->capture_default_str();
  verb->add_option("--runs", a->runs, "runs of each sequence; run K has seed K")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  add_run_options(*verb, *a);
  CLI::Option* time = verb->add_flag(
      "--time", a->time,
      "time one recording instead, by stage, and count its work, by default in mode sequential; writes time.json into "
      "--out");
  verb->add_option("--against", a->against,
                   "compare with this earlier time.json; exit status 1 if a count differs or a time is slower")
      ->needs(time);
  verb->add_option("--margin", a->margin_percent, "tolerated increase of a time in percent")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str()
      ->needs(time);
  verb->add_flag("--overwrite", a->overwrite, "write into a folder that is not empty; earlier results are replaced");
  verb->callback([a, &exit_status] { exit_status = bench(*a); });
}

}  // namespace bslam::cli
