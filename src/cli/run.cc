// bslam run: runs the SLAM system on a recorded data set.
#include <chrono>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/atomic_file.h"
#include "base/option_table.h"
#include "cli/config_arguments.h"
#include "cli/dataset_arguments.h"
#include "cli/interruption.h"
#include "cli/progress_bar.h"
#include "cli/run_log.h"
#include "cli/run_messages.h"
#include "cli/shell_command.h"
#include "cli/verbs.h"
#include "cli/view_arguments.h"
#include "map/rigs_of_map.h"
#include "session/record_builder.h"
#include "session/report_data.h"
#include "session/run_session.h"
#include "session/run_warnings.h"
#include "storage/map_file.h"
#include "storage/vocabulary_file.h"
#include "system/cameras_of_run.h"

namespace bslam::cli {
namespace {

constexpr std::size_t kMaxJournalBytes = std::size_t{1} << 30;  // enough for weeks of recording

const auto g_program_start = std::chrono::steady_clock::now();

struct RunArguments {
  DatasetArguments data;
  ConfigArguments config;
  ViewArguments view;
  std::string out, mode, journal, replay, vocabulary, save_map, load_map;
  std::string pace = "fast", late = "block", progress = "auto", log_level = "warning";
  std::optional<int> seed;
  bool no_loop = false, localize_only = false, no_final_ba = false, no_report = false, overwrite = false,
       image_stamps = false;
  std::string command;  // the command line, as shown in the report
};

// Applies the command-line options that override --config and --set.
Result<system::Config> resolve_run_config(const RunArguments& arguments) {
  auto resolved = resolve_config(arguments.config);
  if (!resolved) return resolved;
  system::Config& config = *resolved;
  if (!arguments.mode.empty()) {
    if (const Status s = OptionTable(config).set("mode", arguments.mode); !s) {
      return Error{"command line", "--mode", s.error().found, s.error().expected};
    }
  }
  if (arguments.seed) config.seed = *arguments.seed;
  if (arguments.no_final_ba) config.final_adjustment = false;
  if (arguments.no_loop) config.looping.loop.enabled = false;
  if (arguments.localize_only) config.localize_only = true;
  if (const Status s = system::check_config(config, !arguments.load_map.empty()); !s) {
    return Error{"command line", s.error().key, s.error().found, s.error().expected};
  }
  return resolved;
}

// Creates the output folder. An existing folder must be empty unless --overwrite is given, which removes the files of
// an earlier run except for those that are input of this run.
Status prepare_folder(const RunArguments& arguments) {
  const std::filesystem::path folder = arguments.out;
  std::error_code error;
  const bool exists = std::filesystem::exists(folder, error);
  if (exists && !std::filesystem::is_directory(folder, error)) {
    return Error{folder.string(), "--out", "a file", "a folder"};
  }
  if (exists && !arguments.overwrite && !std::filesystem::is_empty(folder, error)) {
    return Error{folder.string(), "--out", "a folder that is not empty", "an empty or new folder, or --overwrite"};
  }
  std::filesystem::create_directories(folder, error);
  if (error) return Error{folder.string(), "--out", error.message(), "a folder that can be created"};
  if (const Status status = check_writable(folder / "summary.json"); !status) return status;
  for (const char* name :
       {"config.yaml", "summary.json", "trajectory.svg", "run.svg", "report.html", "rig_refined.yaml"}) {
    const auto is = [&](const std::string& input) {
      return !input.empty() && std::filesystem::equivalent(folder / name, input, error);
    };
    if (!is(arguments.data.rig) && !is(arguments.config.file)) std::filesystem::remove(folder / name, error);
  }
  for (const char* stem : {"trajectory", "trajectory_live"}) {
    for (std::size_t submap = 0; std::filesystem::remove(folder / session::trajectory_file(stem, submap), error);
         ++submap) {
    }
  }
  return {};
}

// Checks before the run whether the file can be written after it. An existing file is replaced only with --overwrite.
Status check_output_file(const std::string& file, const char* option, bool overwrite) {
  if (file.empty()) return {};
  std::error_code error;
  const std::filesystem::path path(file), folder = path.has_parent_path() ? path.parent_path() : ".";
  if (std::filesystem::is_directory(path, error)) return Error{file, option, "a folder", "the name of a file"};
  if (!std::filesystem::is_directory(folder, error))
    return Error{folder.string(), option, "no such folder", "an existing folder"};
  if (std::filesystem::is_regular_file(path, error) && !overwrite)
    return Error{file, option, "an existing file", "a new name, or --overwrite"};
  return check_writable(path);
}

Result<std::optional<execution::Journal>> read_journal(const std::string& file) {
  if (file.empty()) return std::optional<execution::Journal>();
  const auto text = read_file(file, kMaxJournalBytes);
  if (!text) return text.error();
  auto journal = execution::parse_journal(*text, file);
  if (!journal) return journal.error();
  return std::optional(std::move(*journal));
}

// Reads the map of an earlier run if one is given, and checks that this run can continue with it.
Result<std::optional<map::BundledMap>> read_map(const RunArguments& arguments, const camera::Rig& rig,
                                                const system::Config& config, const place::Vocabulary& vocabulary) {
  const std::string& file = arguments.load_map;
  if (file.empty()) return std::optional<map::BundledMap>();
  auto map = storage::open_map(file, rig, config.feature_model().pyramid, &vocabulary);
  if (!map) return map.error();
  if (const Status status = system::check_settings(config, *map, rig); !status) return status.error();
  if (system::shared_with_other_rigs(*map, rig) && log_verbosity(arguments.log_level) >= LogVerbosity::kWarning) {
    const char* const text = map::find_rig(*map, rig)
                                 ? "has further cameras; the calibration is that of the map and is not estimated"
                                 : "was made with another rig or calibration; that of this run is kept as given";
    std::fprintf(stderr, "note: %s %s\n", file.c_str(), text);
  }
  return std::optional(*std::move(map));
}

Status write_files(const session::SessionResult& result, const system::Config& config, const dataset::Dataset& dataset,
                   const RunArguments& arguments, const place::Vocabulary& vocabulary) {
  const auto report =
      arguments.no_report ? std::nullopt : std::optional(session::ReportSource{dataset, arguments.command});
  if (const Status status = session::write_outputs(result, config, arguments.out, report); !status) return status;
  if (!arguments.journal.empty()) {
    const Status status = write_atomically(arguments.journal, execution::journal_text(result.journal));
    if (!status) return status;
  }
  if (arguments.save_map.empty()) return {};
  return storage::write_map(*result.map, {vocabulary.id(), result.record.version, result.record.data},
                            arguments.save_map);
}

// Shows the report of the run in the browsers that have followed it.
void end_view(live_view::LiveView* view, const session::SessionResult& result, const system::Config& config,
              const dataset::Dataset& dataset, const RunArguments& arguments) {
  if (view == nullptr || !view->is_watched()) return;
  view->end(session::report_text(result, config, {dataset, arguments.command}));
}

// Returns the command that tests the calibration of the run against its images.
std::string check_command(const DatasetArguments& data) {
  return shell_command({"bslam", "rig", "info", data.rig.empty() ? data.path : data.rig, "--images", data.path});
}

// Says which topic or video is which camera, if the command line does not say it.
void print_sources(const dataset::Dataset& dataset) {
  std::string text;
  for (std::size_t c = 0; c < dataset.sources.size(); ++c) {
    text += (c == 0 ? "" : ", ") + dataset.rig.camera(c).name + " = " + dataset.sources[c];
  }
  if (!text.empty()) std::fprintf(stderr, "cameras: %s (choose with --topics)\n", text.c_str());
}

void print_before(const dataset::Dataset& dataset, const DatasetArguments& data, LogVerbosity verbosity) {
  if (verbosity < LogVerbosity::kWarning) return;
  if (dataset.format == dataset::DatasetFormat::kBag && data.images.topics.empty()) print_sources(dataset);
  print_warnings(session::warnings_before_run(dataset));
}

void print_after(const session::RunRecord& record, const std::vector<std::string>& warnings,
                 const RunArguments& arguments) {
  const LogVerbosity verbosity = log_verbosity(arguments.log_level);
  if (verbosity >= LogVerbosity::kDebug) print_frames(record);
  if (verbosity >= LogVerbosity::kInfo) print_stage_statistics(record);
  if (verbosity >= LogVerbosity::kWarning) print_warnings(warnings);
  print_result(record, arguments.out);
}

// Returns the warnings after the run; the record gets those before it as well.
std::vector<std::string> note_warnings(const dataset::Dataset& dataset, const DatasetArguments& data,
                                       session::RunRecord& record) {
  const std::vector<std::string> after = session::warnings_after_run(record, dataset.rig, check_command(data));
  record.warnings = session::warnings_before_run(dataset);
  record.warnings.insert(record.warnings.end(), after.begin(), after.end());
  return after;
}

session::SessionOptions session_options(const RunArguments& arguments, const system::Config& config,
                                        const Interruption& interruption) {
  session::SessionOptions options;
  options.config = config;
  options.pace = arguments.pace == "realtime" ? session::Pace::kRealtime : session::Pace::kFast;
  options.late = arguments.late == "drop" ? session::Late::kDrop : session::Late::kBlock;
  options.start_up_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - g_program_start).count();
  options.interrupted = interruption.token();
  return options;
}

int exit_status_of(const session::SessionResult& result) {
  const session::RunRecord& record = result.record;
  if (!record.complete) return kExitInterrupted;
  const bool nothing = record.map.loaded ? session::frames_in_loaded_map(record) == 0 : result.live.empty();
  return nothing ? kExitNothingTracked : kExitOk;
}

int run(const RunArguments& arguments) {
  // Created first: once the output folder exists, an interruption ends the run with complete output files.
  const Interruption interruption;
  auto config = resolve_run_config(arguments);
  if (!config) return report_error(config.error());
  auto replay = read_journal(arguments.replay);
  if (!replay) return report_error(replay.error());
  const auto request = dataset_request(arguments.data, config->io.sync_tolerance);
  if (!request) return report_error(request.error());
  const auto dataset = dataset::open_dataset(*request);
  if (!dataset) return report_error(dataset.error());
  const auto vocabulary = storage::vocabulary_or_shipped(arguments.vocabulary);
  if (!vocabulary) return report_error(vocabulary.error());
  auto map = read_map(arguments, dataset->rig, *config, **vocabulary);
  if (!map) return report_error(map.error());
  if (*map) system::note_other_rigs(**map, dataset->rig, *config);
  for (const auto& [option, file] :
       {std::pair("--save-map", arguments.save_map), std::pair("--journal", arguments.journal)}) {
    if (const Status s = check_output_file(file, option, arguments.overwrite); !s) return report_error(s.error());
  }
  session::RunControl control(arguments.pace == "realtime" ? 1.0 : 0.0);
  auto view =
      start_view(arguments.view, {*dataset, *config, arguments.command, *map ? (*map)->keyframe_slots() : 0}, control);
  if (!view) return report_error(view.error());
  if (const Status s = prepare_folder(arguments); !s) return report_error(s.error());
  if (*view) std::fprintf(stderr, "view: %s\n", (*view)->url().c_str());
  print_before(*dataset, arguments.data, log_verbosity(arguments.log_level));

  ProgressBar bar(arguments.progress == "auto", "frames");
  session::SessionOptions options = session_options(arguments, *config, interruption);
  options.replay = std::move(*replay);
  options.vocabulary = *vocabulary;
  options.map = std::move(*map);
  options.progress = [&bar](std::size_t done, std::size_t all) { bar.show(done, all); };
  options.observer = view->get();
  options.control = &control;
  auto result = session::run_session(*dataset, options);
  bar.finish();
  if (!result) return report_error(result.error());
  if (arguments.image_stamps) result->subtracted_ns = dataset->rig.camera(0).time_offset_ns;
  const std::vector<std::string> warnings = note_warnings(*dataset, arguments.data, result->record);
  if (const Status s = write_files(*result, *config, *dataset, arguments, **vocabulary); !s)
    return report_error(s.error());
  end_view(view->get(), *result, *config, *dataset, arguments);
  print_after(result->record, warnings, arguments);
  return exit_status_of(*result);
}

std::string command_of(std::span<const char* const> command_line) {
  std::vector<std::string> words(command_line.begin(), command_line.end());
  if (!words.empty()) words.front() = std::filesystem::path(words.front()).filename();
  return shell_command(words);
}

void add_map_options(CLI::App& verb, RunArguments& a) {
  verb.add_option("--save-map", a.save_map, "save the final map to this file");
  verb.add_option("--load-map", a.load_map,
                  "saved map to continue after relocalising in it; it may be of another rig or calibration");
  verb.add_flag("--localize-only", a.localize_only, "localise in the loaded map without changing it");
  verb.add_option("--vocabulary", a.vocabulary,
                  "vocabulary for place recognition, in bslam or DBoW2 text format; default: the vocabulary shipped "
                  "with this program");
}

}  // namespace

void add_run(CLI::App& app, std::span<const char* const> command_line, int& exit_status) {
  const auto a = std::make_shared<RunArguments>();
  a->command = command_of(command_line);
  CLI::App* verb = app.add_subcommand("run", "run the SLAM system on a recorded data set");
  add_dataset_options(*verb, a->data);
  verb->add_option("--out", a->out, "folder for trajectory, summary, configuration, report and plots")->required();
  add_config_options(*verb, a->config);
  verb->add_option("--mode", a->mode,
                   "sequential, lagged or parallel (default). Repeated sequential runs give identical results, and so "
                   "do repeated lagged "
                   "runs; the two differ from each other");
  verb->add_option("--journal", a->journal,
                   "write a journal to this file: the map version read and written by each stage");
  verb->add_option("--replay", a->replay, "repeat the run of this journal exactly, regardless of its mode");
  verb->add_option("--pace", a->pace, "fast: as fast as possible; realtime: feed images at their recorded rate")
      ->check(CLI::IsMember({"fast", "realtime"}))
      ->capture_default_str();
  verb->add_option(
          "--late", a->late,
          "with --pace realtime, if processing is too slow: block processes every frame late, drop skips frames")
      ->check(CLI::IsMember({"block", "drop"}))
      ->capture_default_str();
  verb->add_flag("--no-loop", a->no_loop, "disable loop closing; relocalisation stays enabled");
  add_map_options(*verb, *a);
  verb->add_flag("--image-stamps", a->image_stamps,
                 "write trajectories with the time stamps of the images, without the time offset of camera 0");
  verb->add_flag("--no-final-ba", a->no_final_ba, "skip the global bundle adjustment at the end");
  verb->add_flag("--no-report", a->no_report, "do not write report.html, the page that shows the run in a browser");
  add_view_options(*verb, a->view);
  verb->add_option("--seed", a->seed, "seed of all random numbers; default 1")
      ->check(CLI::Range(0, std::numeric_limits<int>::max()));
  verb->add_option("--progress", a->progress, "auto: show a progress bar if stderr is a terminal; never: show none")
      ->check(CLI::IsMember({"auto", "never"}))
      ->capture_default_str();
  verb->add_option("--log-level", a->log_level,
                   "what is printed on stderr: error, warning, info (also the processing time of every stage) or debug "
                   "(also the outcome of every frame)")
      ->check(CLI::IsMember({"error", "warning", "info", "debug"}))
      ->capture_default_str();
  verb->add_flag("--overwrite", a->overwrite,
                 "write into a folder that is not empty; files of an earlier run, a map and a journal are replaced");
  verb->callback([a, &exit_status] { exit_status = run(*a); });
}

}  // namespace bslam::cli
