#include "cli/slam_run.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <tuple>
#include <utility>

#include "base/atomic_file.h"
#include "base/option_table.h"
#include "cli/allocation_count.h"
#include "cli/print_message.h"
#include "cli/rerun.h"
#include "cli/run_messages.h"
#include "cli/shell_command.h"
#include "cli/verbs.h"
#include "map/rigs_of_map.h"
#include "session/earlier_results.h"
#include "session/memory_report.h"
#include "session/report_data.h"
#include "session/run_warnings.h"
#include "storage/map_file.h"
#include "storage/vocabulary_file.h"
#include "system/cameras_of_run.h"

namespace bslam::cli {
namespace {

// Whether a new folder can be created in the first folder above it that exists.
Status check_new_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::path missing = std::filesystem::absolute(folder, error);
  while (missing.has_relative_path() && !std::filesystem::exists(missing.parent_path(), error))
    missing = missing.parent_path();
  const Status s = check_writable(missing);
  if (s) return {};
  return Error{folder.string(), "--out", s.error().found, "a folder that can be created"};
}

// An existing output folder must be empty unless --overwrite is given.
Status check_folder(const SlamArguments& arguments) {
  const std::filesystem::path folder = arguments.out;
  std::error_code error;
  if (!std::filesystem::exists(folder, error)) return check_new_folder(folder);
  if (!std::filesystem::is_directory(folder, error)) return Error{folder.string(), "--out", "a file", "a folder"};
  if (!arguments.overwrite && !std::filesystem::is_empty(folder, error))
    return Error{folder.string(), "--out", "a folder that is not empty", "an empty or new folder, or --overwrite"};
  return check_writable(folder / "summary.json");
}

// Checks that the files beside the results in the folder of the run are neither each other, nor that folder, nor one of
// the results.
Status check_names(std::vector<OutputFile> files, const std::filesystem::path& folder) {
  for (const OutputFile& output : files) {
    if (!session::is_result_file(output.file.filename().string())) continue;
    const std::filesystem::path result = folder / output.file.filename();
    if (!check_distinct({{"--out", result}, output}))
      return Error{output.file.string(), output.option, "the name of a result of the run", "another name"};
  }
  files.push_back({"--out", folder});
  return check_distinct(files);
}

// Creates the output folder, and moves the results of an earlier run aside, except for those that this run reads.
Result<session::EarlierResults> prepare_folder(const SlamArguments& arguments) {
  const std::filesystem::path folder = arguments.out;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Error{folder.string(), "--out", error.message(), "a folder that can be created"};
  if (const Status status = check_writable(folder / "summary.json"); !status) return status.error();
  return session::EarlierResults::move_aside(folder, {arguments.rig, arguments.config.file});
}

// Says that the map has the cameras of this run under other names: they are taken to be the same by their calibrations.
void print_other_names(const std::string& file, const map::BundledMap& map, const camera::Rig& rig) {
  const auto first = map::find_rig(map, rig);
  std::string text;
  for (std::size_t c = 0; first && c < rig.size(); ++c) {
    const std::string &in_map = map.rig().camera(*first + c).name, &here = rig.camera(c).name;
    if (in_map != here) text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", here, in_map);
  }
  if (!text.empty())
    print_message("note: {} has other names for the cameras of this run, which are known by their calibrations: {}\n",
                  file, text);
}

// Reads the map of an earlier run if one is given, and checks that this run can continue with it.
Result<std::optional<storage::SavedMap>> read_map(const SlamArguments& arguments, const camera::Rig& rig,
                                                  const system::Config& config, const place::Vocabulary& vocabulary) {
  const std::string& file = arguments.load_map;
  if (file.empty()) return std::optional<storage::SavedMap>();
  auto saved = storage::open_map(file, rig, config.feature_model().pyramid, &vocabulary);
  if (!saved) return saved.error();
  const map::BundledMap& map = saved->map;
  if (const Status status = system::check_settings(config, map, rig); !status) return status.error();
  if (log_verbosity(arguments.log_level) >= LogVerbosity::kWarning) print_other_names(file, map, rig);
  if (system::shared_with_other_rigs(map, rig) && log_verbosity(arguments.log_level) >= LogVerbosity::kWarning) {
    const auto found = map::find_rig(map, rig);
    const bool moved = found && !map::cameras_of(map.rig(), *found, rig.size()).moves().empty();
    const char* const text =
        moved   ? "was made while a camera was moved; the calibration is that of the map after it and is not estimated"
        : found ? "has further cameras; the calibration is that of the map and is not estimated"
                : "was made with another rig or calibration; that of this run is kept as given";
    print_message("note: {} {}\n", file, text);
  }
  return std::optional(*std::move(saved));
}

// The metadata stored with the map of a run. `map_warning`: the warning stored in the map that it continued.
storage::MapFileInfo map_info(const session::RunRecord& record, const place::Vocabulary& vocabulary,
                              const std::string& map_warning) {
  return {vocabulary.id(), record.version, record.data,
          storage::joined_warnings(map_warning, session::unreliable_map_text(record))};
}

// Whether a file that was asked for is written.
bool is_written(const std::string& file, const session::RunRecord& record) {
  std::error_code error;
  return !file.empty() && !(session::ended_at_once(record) && std::filesystem::exists(file, error));
}

// Writes all files that can be written, in place of those of the earlier run. Returns the errors of the others.
std::vector<Error> write_files(const session::SessionResult& result, const system::Config& config,
                               const dataset::Dataset& dataset, const SlamArguments& arguments,
                               const storage::MapFileInfo& info, session::EarlierResults& earlier) {
  earlier.replace(result.record.complete);
  const auto report = arguments.no_report
                          ? std::nullopt
                          : std::optional(session::ReportSource{dataset, arguments.command, arguments.up});
  std::vector<Error> errors = session::write_outputs(result, config, arguments.out, report);
  const auto note = [&errors](const Status& status) {
    if (!status) errors.push_back(status.error());
  };
  if (is_written(arguments.journal, result.record))
    note(write_atomically(arguments.journal, execution::journal_text(result.journal)));
  if (is_written(arguments.save_map, result.record)) note(storage::write_map(*result.map, info, arguments.save_map));
  return errors;
}

Status show_in_rerun(const SlamArguments& arguments, const session::RunRecord& record) {
  return is_written(arguments.rerun, record) ? send_to_rerun(arguments.out, arguments.rerun) : Status();
}

// Shows the report of the run in the browsers that have followed it.
void end_view(live_view::LiveView* view, const session::SessionResult& result, const system::Config& config,
              const dataset::Dataset& dataset, const SlamArguments& arguments) {
  if (view == nullptr || !view->is_watched()) return;
  view->end(session::report_text(result, config, {dataset, arguments.command, arguments.up}));
}

// The data of the report are made while it is written.
void note_report_size(session::SessionResult& result, const system::Config& config, const dataset::Dataset& dataset,
                      const SlamArguments& arguments) {
  if (arguments.no_report) return;
  const std::string data = session::report_text(result, config, {dataset, arguments.command, arguments.up});
  session::add_largest(result.record.memory, "data of the report", data.size());
}

// The warnings about the loaded map, if there is one.
std::vector<std::string> warnings_of_map(const std::optional<storage::SavedMap>& loaded) {
  std::vector<std::string> out;
  if (!loaded) return out;
  const std::string &file = loaded->file, &warning = loaded->info.warning;
  if (!warning.empty()) out.push_back(file + ": the run that made this map has found: " + warning);
  if (loaded->words_end == 0)
    out.push_back(file + ": the map has no visual words, so that the rig cannot be found in it");
  return out;
}

// Returns the warnings after the run; the record gets those before it and of the source of the frames as well.
std::vector<std::string> note_warnings(const RunInput& input, const std::vector<std::string>& of_map,
                                       const std::vector<std::string>& of_source, session::RunRecord& record) {
  const std::vector<std::string> after = session::warnings_after_run(record, input.dataset.rig, input.check_command);
  record.warnings = of_map;
  const std::vector<std::string> before = session::warnings_before_run(input.dataset);
  record.warnings.insert(record.warnings.end(), before.begin(), before.end());
  record.warnings.insert(record.warnings.end(), of_source.begin(), of_source.end());
  record.warnings.insert(record.warnings.end(), after.begin(), after.end());
  return after;
}

void print_after(const session::RunRecord& record, const std::vector<std::string>& warnings,
                 const SlamArguments& arguments) {
  const LogVerbosity verbosity = log_verbosity(arguments.log_level);
  if (verbosity >= LogVerbosity::kDebug) print_frames(record);
  if (verbosity >= LogVerbosity::kInfo) print_stage_statistics(record);
  if (verbosity >= LogVerbosity::kWarning) print_warnings(warnings);
  print_result(record, arguments.out);
  if (!record.memory.parts.empty()) fmt::print("\n{}", session::memory_text(record));
}

// The options of the session that do not depend on the source of its frames.
void complete_options(const SlamArguments& arguments, live_view::LiveView* view, session::RunControl& control,
                      RunInput& input) {
  session::SessionOptions& options = input.options;
  options.config = input.config;
  options.observer = view;
  options.control = &control;
  options.memory_report = arguments.memory_report;
  if (arguments.count_allocations) options.allocations = begin_counting_allocations();
}

int exit_status_of(const session::SessionResult& result) {
  const session::RunRecord& record = result.record;
  if (!record.complete) return kExitInterrupted;
  const bool nothing = record.map.loaded ? session::frames_in_loaded_map(record) == 0 : result.live.empty();
  return nothing ? kExitNothingTracked : kExitOk;
}

void add_map_options(CLI::App& verb, SlamArguments& a) {
  verb.add_option("--save-map", a.save_map, "save the final map to this file");
  verb.add_option("--load-map", a.load_map,
                  "saved map to continue after relocalising in it; it may be of another rig or calibration");
  verb.add_flag("--localize-only", a.localize_only, "localise in the loaded map without changing it");
  verb.add_option("--vocabulary", a.vocabulary,
                  "vocabulary for place recognition, in bslam or DBoW2 text format; default: the vocabulary shipped "
                  "with this program");
}

void add_up_option(CLI::App& verb, SlamArguments& a) {
  verb.add_option_function<std::string>(
      "--up",
      [&a](const std::string& text) {
        const auto up = geometry::parse_up_axis(text);
        if (!up) throw CLI::ValidationError("--up", "found " + up.error().found + ", expected " + up.error().expected);
        a.up = *up;
      },
      "the axis that points upward in the views of report.html and --view, such as body:z, camera:-y or "
      "world:0,-1,0.2; default: that of camera 0's images");
}

}  // namespace

Result<system::Config> resolve_run_config(const SlamArguments& arguments) {
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

Status check_outputs(const SlamArguments& arguments, std::vector<OutputFile> further) {
  if (const Status s = check_folder(arguments); !s) return s;
  const bool writes_rerun = !is_viewer(arguments.rerun);
  further.insert(further.end(), {{"--save-map", arguments.save_map},
                                 {"--journal", arguments.journal},
                                 {"--rerun", writes_rerun ? arguments.rerun : ""}});
  if (const Status s = check_names(std::move(further), arguments.out); !s) return s;
  for (const auto& [option, file, begin] :
       {std::tuple("--save-map", arguments.save_map, storage::kMapFileBegin),
        std::tuple("--journal", arguments.journal, std::string_view("bslam-journal")),
        std::tuple("--rerun", writes_rerun ? arguments.rerun : "", std::string_view("RRF"))}) {
    if (const Status s = check_output_file(file, option, arguments.overwrite, begin); !s) return s;
  }
  return arguments.rerun.empty() ? Status() : check_rerun(arguments.rerun);
}

int run_and_write(const SlamArguments& arguments, RunInput input, session::RunControl& control) {
  const dataset::Dataset& dataset = input.dataset;
  session::SessionOptions& options = input.options;
  const auto vocabulary = storage::vocabulary_or_shipped(arguments.vocabulary);
  if (!vocabulary) return report_error(vocabulary.error());
  auto loaded = read_map(arguments, dataset.rig, input.config, **vocabulary);
  if (!loaded) return report_error(loaded.error());
  const std::string map_warning = *loaded ? (*loaded)->info.warning : "";
  if (*loaded) options.map = std::move((*loaded)->map);
  if (options.map) system::note_other_rigs(*options.map, dataset.rig, input.config);
  auto view = start_view(
      arguments.view,
      {dataset, input.config, arguments.command, options.map ? options.map->keyframe_slots() : 0, arguments.up},
      control);
  if (!view) return report_error(view.error());
  auto earlier = prepare_folder(arguments);  // its results come back if this run has none
  if (!earlier) return report_error(earlier.error());
  if (*view) print_message("view: {}\n", (*view)->url());
  const std::vector<std::string> of_map = warnings_of_map(*loaded);
  if (log_verbosity(arguments.log_level) >= LogVerbosity::kWarning) print_warnings(of_map);
  if (const Status s = input.before ? input.before() : Status(); !s) return report_error(s.error());

  options.vocabulary = *vocabulary;
  complete_options(arguments, view->get(), control, input);
  auto result = session::run_session(dataset, options);
  const std::vector<std::string> of_source = input.after ? input.after() : std::vector<std::string>();
  if (!result) return report_error(result.error());
  if (session::ended_at_once(result->record) && earlier->any()) {
    print_message("the run ended before its first frame; the earlier results in {} are kept\n", arguments.out);
    return exit_status_of(*result);
  }
  if (arguments.image_stamps) result->subtracted_ns = dataset.rig.camera(0).time_offset_ns;
  const std::vector<std::string> warnings = note_warnings(input, of_map, of_source, result->record);
  if (!result->record.memory.parts.empty()) note_report_size(*result, input.config, dataset, arguments);
  const storage::MapFileInfo info = map_info(result->record, **vocabulary, map_warning);
  const std::vector<Error> unwritten = write_files(*result, input.config, dataset, arguments, info, *earlier);
  const Status sent = unwritten.empty() ? show_in_rerun(arguments, result->record) : Status();
  end_view(view->get(), *result, input.config, dataset, arguments);
  print_after(result->record, warnings, arguments);
  std::fflush(stdout);  // so that the result appears before the errors about files
  for (const Error& error : unwritten) report_error(error);
  if (!unwritten.empty()) return kExitBadInput;
  if (!sent) return report_error(sent.error());
  return exit_status_of(*result);
}

std::string command_of(std::span<const char* const> command_line) {
  std::vector<std::string> words(command_line.begin(), command_line.end());
  if (!words.empty()) words.front() = std::filesystem::path(words.front()).filename();
  return shell_command(words);
}

void add_slam_options(CLI::App& verb, SlamArguments& a) {
  verb.add_option("--out", a.out, "folder for trajectory, summary, configuration, report and plots")->required();
  add_config_options(verb, a.config);
  verb.add_option("--mode", a.mode,
                  "sequential, lagged or parallel (default). Repeated sequential runs give identical results, and so "
                  "do repeated lagged "
                  "runs; the two differ from each other");
  verb.add_option("--journal", a.journal,
                  "write a journal to this file: the map version read and written by each stage");
  verb.add_flag("--no-loop", a.no_loop, "disable loop closing; relocalisation stays enabled");
  add_map_options(verb, a);
  verb.add_flag("--image-stamps", a.image_stamps,
                "write trajectories with the time stamps of the images, without the time offset of camera 0");
  verb.add_flag("--no-final-ba", a.no_final_ba, "skip the global bundle adjustment at the end");
  CLI::Option* no_report =
      verb.add_flag("--no-report", a.no_report, "do not write report.html, the page that shows the run in a browser");
  add_up_option(verb, a);
  verb.add_option(
          "--rerun", a.rerun,
          "show the result in Rerun: a file to be written, such as run.rrd, or the address of a viewer, such as "
          "rerun+http://127.0.0.1:9876/proxy; needs the Python packages bslam and rerun-sdk")
      ->excludes(no_report);
  add_view_options(verb, a.view);
  verb.add_flag("--memory-report", a.memory_report,
                "print at the end how much memory the map, the vocabulary, images and records hold; also in "
                "summary.json");
  verb.add_flag("--count-allocations", a.count_allocations,
                "count the heap allocations of the run, for the key `work` of summary.json");
  verb.add_option("--seed", a.seed, "seed of all random numbers; default 1")
      ->check(CLI::Range(0, std::numeric_limits<int>::max()));
  verb.add_option("--progress", a.progress, "auto: show a progress bar if stderr is a terminal; never: show none")
      ->check(CLI::IsMember({"auto", "never"}))
      ->capture_default_str();
  verb.add_option("--log-level", a.log_level,
                  "what is printed on stderr: error, warning, info (also the processing time of every stage) or debug "
                  "(also the outcome of every frame)")
      ->check(CLI::IsMember({"error", "warning", "info", "debug"}))
      ->capture_default_str();
  verb.add_flag(
      "--overwrite", a.overwrite,
      "write into a folder that is not empty; files of an earlier run, and others that are written, are replaced");
}

}  // namespace bslam::cli
