// bslam simulate: renders images of a built-in world as seen by a rig.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "base/cores.h"
#include "cli/interruption.h"
#include "cli/print_message.h"
#include "cli/progress_bar.h"
#include "cli/verbs.h"
#include "rig_formats/rig_file.h"
#include "simulator/fault_file.h"
#include "simulator/simulation_writer.h"
#include "synthetic/rigs.h"

namespace bslam::cli {
namespace {

struct SimulateArguments {
  std::string folder, world = "building", progress = "auto";
  std::optional<std::string> rig, faults;
  std::optional<double> duration_s;
  std::optional<std::string> length;
  double rate_hz = 20.0, exposure_ms = 5.0, noise = 1.0, speed_mps = 0.0;
  double start_s = 1.0;
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> tour_seed;
  int laps = 0, threads = 0;
  bool back = false, overwrite = false;
};

const std::map<std::string, simulator::WorldKind> kWorlds = {{"building", simulator::WorldKind::kBuilding},
                                                             {"corridor", simulator::WorldKind::kCorridor},
                                                             {"twin-rooms", simulator::WorldKind::kTwinRooms},
                                                             {"outdoor", simulator::WorldKind::kOutdoor},
                                                             {"town", simulator::WorldKind::kTown}};

// Reads a length such as 5km, 800m or 800 in metres.
Result<double> read_length(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string unit(end, text.data() + text.size());
  if (error == std::errc() && (unit.empty() || unit == "m")) return value;
  if (error == std::errc() && unit == "km") return 1000 * value;
  return Error{"command line", "--length", text, "a length such as 5km, 800m or a number of metres"};
}

// A value out of range: the key becomes the name of the option.
Error as_option(Error error) {
  if (!error.file.empty()) return error;
  error.file = "command line";
  error.key = "--" + error.key;
  return error;
}

// Sets length and duration. The duration of a drive through the town follows from its length and speed.
Status set_extent(const SimulateArguments& arguments, simulator::SimulationRequest& request) {
  const bool town = request.kind == simulator::WorldKind::kTown;
  if (arguments.length && !town)
    return Error{"command line", "--length", *arguments.length, "a length with --world town only"};
  if (town) {
    const auto length = read_length(arguments.length.value_or("1km"));
    if (!length) return length.error();
    request.tour.length_m = *length;
  }
  request.recording.duration_s = arguments.duration_s.value_or(20.0);
  if (!town || arguments.duration_s) return {};
  const auto whole = simulator::drive_duration(request);
  if (!whole) return as_option(whole.error());
  request.recording.duration_s = *whole;
  return {};
}

Result<simulator::SimulationRequest> make_request(const SimulateArguments& arguments) {
  constexpr double kMaxStart_s = 4e9;
  if (!(arguments.start_s >= 0 && arguments.start_s <= kMaxStart_s))
    return Error{"command line", "--start", fmt::format("{}", arguments.start_s), "seconds in [0, 4e9]"};
  std::optional<camera::Rig> rig;
  if (arguments.rig) {
    auto read = rig_formats::read_rig(*arguments.rig);
    if (!read) return read.error();
    rig = std::move(read).value();
  } else {
    rig = synthetic::default_rig();
  }
  simulator::SimulationRequest request{.folder = arguments.folder,
                                       .rig = *rig,
                                       .recording = {},
                                       .tour = {},
                                       .imaging = {},
                                       .world = {},
                                       .kind = kWorlds.at(arguments.world),
                                       .seed = arguments.seed,
                                       .overwrite = arguments.overwrite};
  request.recording.rate_hz = arguments.rate_hz;
  request.recording.exposure_s = 1e-3 * arguments.exposure_ms;
  request.imaging.noise = arguments.noise;
  request.recording.start_ns = from_seconds(arguments.start_s);
  request.imaging.seed = request.tour.seed = arguments.tour_seed.value_or(arguments.seed);
  request.tour.laps = arguments.laps;
  request.tour.speed_mps = arguments.speed_mps;
  request.tour.back = arguments.back;
  if (const Status s = set_extent(arguments, request); !s) return s.error();
  if (arguments.faults) {
    auto faults = simulator::read_faults(*arguments.faults, rig->size());
    if (!faults) return faults.error();
    request.recording.faults = std::move(faults).value();
  }
  return request;
}

int run_simulate(const SimulateArguments& arguments) {
  const auto request = make_request(arguments);
  if (!request) return report_error(request.error());
  ThreadPool pool(arguments.threads > 0 ? arguments.threads : processor_cores());
  const Interruption interruption;
  ProgressBar bar(arguments.progress == "auto", "images");
  const auto outcome = simulator::write_simulation(
      *request, pool, [&](std::size_t done, std::size_t total) { bar.show(done, total); }, interruption.token());
  bar.finish();
  if (!outcome) return report_error(as_option(outcome.error()));
  switch (*outcome) {
    case simulator::SimulationOutcome::kWritten:
      fmt::print("{}: {} frames of {} cameras\n", arguments.folder, simulator::frame_count(request->recording),
                 request->rig.size());
      break;
    case simulator::SimulationOutcome::kWasComplete:
      fmt::print("{}: already complete\n", arguments.folder);
      break;
    case simulator::SimulationOutcome::kInterrupted:
      print_message("bslam: interrupted; repeat the same command to continue\n");
      return kExitInterrupted;
  }
  return kExitOk;
}

}  // namespace

void add_simulate(CLI::App& app, int& exit_status) {
  const auto arguments = std::make_shared<SimulateArguments>();
  SimulateArguments& a = *arguments;
  CLI::App* verb = app.add_subcommand(
      "simulate", "render images of a built-in world as seen by a rig, in EuRoC layout with ground truth");
  verb->add_option("--out", a.folder, "folder to write into")->required();
  verb->add_option("--rig", a.rig, "calibration of the rig (default: four cameras, two of them in front)");
  verb->add_option("--world", a.world,
                   "building: different rooms; corridor, twin-rooms: places that look exactly alike; outdoor: a square "
                   "with houses and trees; town: a drive through streets, with loops")
      ->check(CLI::IsMember({"building", "corridor", "twin-rooms", "outdoor", "town"}))
      ->capture_default_str();
  verb->add_option("--duration", a.duration_s,
                   "duration in seconds (default: 20, or that of the whole drive through the town)");
  verb->add_option("--length", a.length,
                   "length of the drive through the town, such as 5km or 800m, from 200m to 100km (default: 1km)");
  verb->add_option("--rate", a.rate_hz, "frame rate of each camera in images per second")->capture_default_str();
  verb->add_option("--seed", a.seed, "seed of world, motion and noise")->capture_default_str();
  verb->add_option("--tour-seed", a.tour_seed,
                   "seed of motion and noise, for further tours of one world (default: that of --seed)");
  verb->add_option("--start", a.start_s, "time stamp of the first images in seconds")->capture_default_str();
  verb->add_option("--laps", a.laps, "laps of the tour within the duration; 0: as many as a walking pace allows")
      ->capture_default_str();
  verb->add_option("--speed", a.speed_mps,
                   "speed in metres per second; 0: determined by duration and laps, or 8 in the town")
      ->capture_default_str();
  verb->add_flag("--back", a.back, "turn around after half of the duration and return along the same path");
  verb->add_option("--exposure-ms", a.exposure_ms, "exposure time in milliseconds, which causes motion blur")
      ->capture_default_str();
  verb->add_option("--noise", a.noise, "factor applied to the sensor noise")->capture_default_str();
  verb->add_option("--faults", a.faults,
                   fmt::format("YAML or JSON list of {{type, cameras, from, to}}; type: {} (with delay_s)",
                               simulator::fault_names()));
  verb->add_option("--threads", a.threads, "number of threads; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  verb->add_option("--progress", a.progress, "auto: show a progress bar if stderr is a terminal; never: show none")
      ->check(CLI::IsMember({"auto", "never"}))
      ->capture_default_str();
  verb->add_flag("--overwrite", a.overwrite,
                 "write into a folder that is not empty; an earlier recording in it is replaced");
  verb->callback([arguments, &exit_status] { exit_status = run_simulate(*arguments); });
}

}  // namespace bslam::cli
