// bslam run: SLAM over a recorded data set.
#include <chrono>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/atomic_file.h"
#include "base/option_table.h"
#include "cli/config_arguments.h"
#include "cli/dataset_arguments.h"
#include "cli/interruption.h"
#include "cli/progress_bar.h"
#include "cli/run_messages.h"
#include "cli/verbs.h"
#include "session/record_builder.h"
#include "session/run_session.h"
#include "storage/map_file.h"
#include "storage/vocabulary_file.h"

namespace bslam::cli {
namespace {

constexpr std::size_t kMaxJournalBytes = std::size_t{1} << 30;  // some weeks of frames

const auto g_program_start = std::chrono::steady_clock::now();

struct RunArguments {
  DatasetArguments data;
  ConfigArguments config;
  std::string out, mode, journal, replay, vocabulary, save_map, load_map, pace = "fast", late = "block",
                                                                          progress = "auto";
  std::optional<int> seed;
  bool no_loop = false, localize_only = false, no_final_ba = false, overwrite = false;
};

// The options of the command line win over file and single settings.
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

// Makes the folder; an existing one must be empty or given up for overwriting, and then loses the files of an earlier
// run, but not those this one was told to read.
Status prepare_folder(const RunArguments& arguments) {
  const std::filesystem::path folder = arguments.out;
  std::error_code error;
  const bool exists = std::filesystem::exists(folder, error);
  if (exists && !std::filesystem::is_directory(folder, error)) {
    return Error{folder.string(), "--out", "a file", "a folder"};
  }
  if (exists && !arguments.overwrite && !std::filesystem::is_empty(folder, error)) {
    return Error{folder.string(), "--out", "a folder that is not empty", "an empty or new one, or --overwrite"};
  }
  std::filesystem::create_directories(folder, error);
  if (error) return Error{folder.string(), "--out", error.message(), "a folder that can be made"};
  for (const char* name : {"config.yaml", "summary.json", "trajectory.svg", "run.svg", "rig_refined.yaml"}) {
    const auto is = [&](const std::string& input) {
      return !input.empty() && std::filesystem::equivalent(folder / name, input, error);
    };
    if (!is(arguments.data.rig) && !is(arguments.config.file)) std::filesystem::remove(folder / name, error);
  }
  for (const char* stem : {"trajectory", "trajectory_live"}) {
    for (std::size_t part = 0; std::filesystem::remove(folder / session::trajectory_file(stem, part), error); ++part) {
    }
  }
  return {};
}

// Before hours of work, not after: can a file be made there? An existing one is replaced.
Status check_output_file(const std::string& file, const char* option) {
  if (file.empty()) return {};
  std::error_code error;
  const std::filesystem::path path(file), folder = path.has_parent_path() ? path.parent_path() : ".";
  if (std::filesystem::is_directory(path, error)) return Error{file, option, "a folder", "the name of a file"};
  if (!std::filesystem::is_directory(folder, error))
    return Error{folder.string(), option, "no such folder", "one that exists"};
  return {};
}

Result<std::optional<execution::Journal>> read_journal(const std::string& file) {
  if (file.empty()) return std::optional<execution::Journal>();
  const auto text = read_file(file, kMaxJournalBytes);
  if (!text) return text.error();
  auto journal = execution::parse_journal(*text, file);
  if (!journal) return journal.error();
  return std::optional(std::move(*journal));
}

// The map of an earlier run, if one is asked for, and whether this one can go on with it.
Result<std::optional<map::BundledMap>> read_map(const std::string& file, const camera::Rig& rig,
                                                const system::Config& config, const place::Vocabulary& vocabulary) {
  if (file.empty()) return std::optional<map::BundledMap>();
  auto map = storage::open_map(file, rig, {config.features.scale_factor, config.features.levels}, &vocabulary);
  if (!map) return map.error();
  return std::optional(*std::move(map));
}

Status write_files(const session::SessionResult& result, const system::Config& config, const RunArguments& arguments,
                   const place::Vocabulary& vocabulary) {
  if (const Status status = session::write_outputs(result, config, arguments.out); !status) return status;
  if (!arguments.journal.empty()) {
    const Status status = write_atomically(arguments.journal, execution::journal_text(result.journal));
    if (!status) return status;
  }
  if (arguments.save_map.empty()) return {};
  return storage::write_map(*result.map, {vocabulary.id(), result.record.version, result.record.data},
                            arguments.save_map);
}

int run(const RunArguments& arguments) {
  // Before anything is made: whoever sees the folder can rely on an interruption being answered in order.
  const Interruption interruption;
  const auto config = resolve_run_config(arguments);
  if (!config) return report_error(config.error());
  auto replay = read_journal(arguments.replay);
  if (!replay) return report_error(replay.error());
  const auto request = dataset_request(arguments.data, config->io.sync_tolerance);
  if (!request) return report_error(request.error());
  const auto dataset = dataset::open_dataset(*request);
  if (!dataset) return report_error(dataset.error());
  const auto vocabulary = storage::vocabulary_or_shipped(arguments.vocabulary);
  if (!vocabulary) return report_error(vocabulary.error());
  auto map = read_map(arguments.load_map, dataset->rig, *config, **vocabulary);
  if (!map) return report_error(map.error());
  for (const auto& [option, file] :
       {std::pair("--save-map", arguments.save_map), std::pair("--journal", arguments.journal)}) {
    if (const Status s = check_output_file(file, option); !s) return report_error(s.error());
  }
  if (const Status s = prepare_folder(arguments); !s) return report_error(s.error());
  for (const std::string& warning : dataset->warnings) std::fprintf(stderr, "warning: %s\n", warning.c_str());
  print_rig_warnings(dataset->rig);

  ProgressBar bar(arguments.progress == "auto", "frames");
  session::SessionOptions options;
  options.config = *config;
  options.pace = arguments.pace == "realtime" ? session::Pace::kRealtime : session::Pace::kFast;
  options.late = arguments.late == "drop" ? session::Late::kDrop : session::Late::kBlock;
  options.start_up_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - g_program_start).count();
  options.interrupted = interruption.token();
  options.replay = std::move(*replay);
  options.vocabulary = *vocabulary;
  options.map = std::move(*map);
  options.progress = [&bar](std::size_t done, std::size_t all) { bar.show(done, all); };
  const auto result = session::run_session(*dataset, options);
  bar.finish();
  if (!result) return report_error(result.error());
  if (const Status s = write_files(*result, *config, arguments, **vocabulary); !s) return report_error(s.error());
  print_warnings(result->record, dataset->rig);
  print_result(result->record, arguments.out);
  if (!result->record.complete) return kExitInterrupted;
  return result->live.empty() ? kExitNothingTracked : kExitOk;
}

}  // namespace

void add_run(CLI::App& app, int& exit_status) {
  const auto a = std::make_shared<RunArguments>();
  CLI::App* verb = app.add_subcommand("run", "SLAM over a recorded data set");
  add_dataset_options(*verb, a->data);
  verb->add_option("--out", a->out, "folder for trajectory, summary, configuration and plots")->required();
  add_config_options(*verb, a->config);
  verb->add_option("--mode", a->mode,
                   "sequential or lagged (identical bytes on every run), or parallel; default parallel");
  verb->add_option("--journal", a->journal, "file to write: which stage worked on and made which version of the map");
  verb->add_option("--replay", a->replay, "a journal: the run it was written by is repeated, whatever its mode was");
  verb->add_option("--pace", a->pace, "fast, or realtime: images at their recorded pace")
      ->check(CLI::IsMember({"fast", "realtime"}))
      ->capture_default_str();
  verb->add_option("--late", a->late,
                   "at the recorded pace: block keeps every frame, drop leaves out those there is no time for")
      ->check(CLI::IsMember({"block", "drop"}))
      ->capture_default_str();
  verb->add_flag("--no-loop", a->no_loop, "loop closing off; a lost rig is still looked for all over the map");
  verb->add_option("--save-map", a->save_map, "file for the map at the end");
  verb->add_option("--load-map", a->load_map, "a saved map: the run goes on in it once it finds its place there");
  verb->add_flag("--localize-only", a->localize_only, "poses in the loaded map, which stays as it is");
  verb->add_option("--vocabulary", a->vocabulary,
                   "for place recognition, ours or DBoW2's text; default: the one of the program");
  verb->add_flag("--no-final-ba", a->no_final_ba, "no global bundle adjustment at the end");
  verb->add_option("--seed", a->seed, "of all randomness; default 1")
      ->check(CLI::Range(0, std::numeric_limits<int>::max()));
  verb->add_option("--progress", a->progress, "auto: a bar when stderr is a terminal; never")
      ->check(CLI::IsMember({"auto", "never"}))
      ->capture_default_str();
  verb->add_flag("--overwrite", a->overwrite, "the folder may exist; files of an earlier run are replaced");
  verb->callback([a, &exit_status] { exit_status = run(*a); });
}

}  // namespace bslam::cli
