// bslam run: runs the SLAM system on a recorded data set.
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/atomic_file.h"
#include "base/output_file.h"
#include "cli/dataset_arguments.h"
#include "cli/interruption.h"
#include "cli/print_message.h"
#include "cli/progress_bar.h"
#include "cli/run_messages.h"
#include "cli/shell_command.h"
#include "cli/slam_run.h"
#include "cli/verbs.h"
#include "session/run_warnings.h"

namespace bslam::cli {
namespace {

constexpr std::size_t kMaxJournalBytes = std::size_t{1} << 30;  // enough for weeks of recording

const auto g_program_start = std::chrono::steady_clock::now();

struct RunArguments {
  DatasetArguments data;
  SlamArguments slam;
  std::string replay, pace = "fast", late = "block";
};

Result<std::optional<execution::Journal>> read_journal(const std::string& file) {
  if (file.empty()) return std::optional<execution::Journal>();
  const auto text = read_file(file, kMaxJournalBytes);
  if (!text) return text.error();
  auto journal = execution::parse_journal(*text, file);
  if (!journal) return journal.error();
  return std::optional(std::move(*journal));
}

// Returns the command that tests the calibration of the run against its images.
std::string check_command(const DatasetArguments& data) {
  std::vector<std::string> command = {"bslam",    "rig",    "info", data.rig.empty() ? data.path : data.rig,
                                      "--images", data.path};
  const auto add = [&](const char* option, const std::string& value) {
    if (!value.empty()) command.insert(command.end(), {option, value});
  };
  const ImageArguments& images = data.images;
  add("--topics", images.topics);
  if (images.side_by_side) command.push_back("--side-by-side");
  if (images.rate_hz) add("--rate", fmt::format("{}", *images.rate_hz));
  add("--stamp-unit", images.stamp_unit);
  add("--bayer", images.bayer);
  add("--masks", images.masks);
  return shell_command(command);
}

// Says which topic or folder is which camera, if the command line does not say it.
void print_sources(const dataset::Dataset& dataset) {
  std::string text;
  for (std::size_t c = 0; c < dataset.sources.size(); ++c) {
    text += (c == 0 ? "" : ", ") + dataset.rig.camera(c).name + " = " + dataset.sources[c];
  }
  const bool folders = dataset.format == dataset::DatasetFormat::kFolder;
  const char* const how = dataset.sources_by_topic  ? "by the topics that the calibration names"
                          : dataset.sources_by_name ? "by their names"
                          : folders                 ? "in the order of their names; choose with --topics"
                                                    : "choose with --topics";
  if (!text.empty()) print_message("cameras: {} ({})\n", text, how);
}

void print_before(const dataset::Dataset& dataset, const DatasetArguments& data, LogVerbosity verbosity) {
  if (verbosity < LogVerbosity::kWarning) return;
  const bool named =
      dataset.format == dataset::DatasetFormat::kBag || dataset.format == dataset::DatasetFormat::kFolder;
  if (named && data.images.topics.empty()) print_sources(dataset);
  print_warnings(session::warnings_before_run(dataset));
}

session::SessionOptions session_options(const RunArguments& arguments, const Interruption& interruption) {
  session::SessionOptions options;
  options.pace = arguments.pace == "realtime" ? session::Pace::kRealtime : session::Pace::kFast;
  options.late = arguments.late == "drop" ? session::Late::kDrop : session::Late::kBlock;
  options.start_up_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - g_program_start).count();
  options.interrupted = interruption.token();
  return options;
}

int run(RunArguments& arguments) {
  // Created first: once the output folder exists, an interruption ends the run with complete output files.
  const Interruption interruption;
  arguments.slam.rig = arguments.data.rig;
  if (arguments.late == "drop" && arguments.pace != "realtime" && arguments.replay.empty())
    return report_error({"command line", "--late", "drop without --pace realtime",
                         "--pace realtime as well, since no frame is late otherwise"});
  const auto config = resolve_run_config(arguments.slam);
  if (!config) return report_error(config.error());
  auto replay = read_journal(arguments.replay);
  if (!replay) return report_error(replay.error());
  const auto request = dataset_request(arguments.data, config->io.sync_tolerance);
  if (!request) return report_error(request.error());
  const auto dataset = dataset::open_dataset(*request);
  if (!dataset) return report_error(dataset.error());

  for (const Status& s :
       {check_not_input(arguments.slam.journal, "--journal", {arguments.replay}), check_outputs(arguments.slam)})
    if (!s) return report_error(s.error());
  RunInput input{*config, *dataset, session_options(arguments, interruption), check_command(arguments.data)};
  ProgressBar bar(arguments.slam.progress == "auto", "frames");
  input.options.replay = std::move(*replay);
  input.options.progress = [&bar](std::size_t done, std::size_t all) { bar.show(done, all); };
  input.before = [&]() -> Status {
    print_before(*dataset, arguments.data, log_verbosity(arguments.slam.log_level));
    return {};
  };
  input.after = [&bar] {
    bar.finish();
    return std::vector<std::string>();
  };
  session::RunControl control(arguments.pace == "realtime" ? 1.0 : 0.0);
  return run_and_write(arguments.slam, std::move(input), control);
}

}  // namespace

void add_run(CLI::App& app, std::span<const char* const> command_line, int& exit_status) {
  const auto a = std::make_shared<RunArguments>();
  a->slam.command = command_of(command_line);
  CLI::App* verb = app.add_subcommand("run", "run the SLAM system on a recorded data set");
  add_dataset_options(*verb, a->data);
  add_slam_options(*verb, a->slam);
  verb->add_option("--replay", a->replay, "repeat the run of this journal exactly, regardless of its mode");
  verb->add_option("--pace", a->pace, "fast: as fast as possible; realtime: feed images at their recorded rate")
      ->check(CLI::IsMember({"fast", "realtime"}))
      ->capture_default_str();
  verb->add_option("--late", a->late,
                   "with --pace realtime, if processing is too slow: block processes every frame late, drop does less "
                   "work per frame and, if that does not suffice, drops frames")
      ->check(CLI::IsMember({"block", "drop"}))
      ->capture_default_str();
  verb->callback([a, &exit_status] { exit_status = run(*a); });
}

}  // namespace bslam::cli
