// Measures whether a map stops growing once the place is mapped. Plays a recording of closed laps several times, and
// prints the size of the map and the time of the frames for each lap.
//   bslam_lap_growth DATA --laps 5 --times 4 [--cameras 0,1] [--set key=value ...]
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>

#include "base/median.h"
#include "cli/config_arguments.h"
#include "dataset/dataset.h"
#include "session/frame_source.h"
#include "storage/vocabulary_file.h"
#include "system/system.h"

namespace bslam {
namespace {

struct Arguments {
  std::string data;
  int laps = 5, times = 4;
  std::vector<int> cameras;
  cli::ConfigArguments config;
};

double resident_mb() {
  std::ifstream file("/proc/self/statm");
  double pages = 0, resident = 0;
  file >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

// Prints the statistics of every lap.
class LapTable {
 public:
  LapTable(const system::System& system, std::size_t frames_per_lap)
      : system_(system), frames_per_lap_(frames_per_lap) {
    fmt::print(
        "| lap | new keyframes | keyframes | landmarks | observations | loops | memory [MB] | frame [ms] |\n"
        "|---|---|---|---|---|---|---|---|\n");
  }
  void after_frame() {
    const std::vector<system::FrameRecord>& frames = system_.frames();
    if (frames.size() % frames_per_lap_ != 0) return;
    std::vector<double> ms;
    int born = 0;
    for (std::size_t i = frames.size() - frames_per_lap_; i < frames.size(); ++i) {
      ms.push_back(frames[i].frame_ms);
      born += frames[i].keyframe;
    }
    const map::MapSnapshot map = system_.snapshot();
    fmt::print("| {} | {} | {} | {} | {} | {} | {:.0f} | {:.1f} |\n", frames.size() / frames_per_lap_, born,
               map->num_keyframes(), map->num_landmarks(), map->num_observations(), system_.loops().size(),
               resident_mb(), median(std::move(ms)));
    std::fflush(stdout);
  }

 private:
  const system::System& system_;
  const std::size_t frames_per_lap_;
};

Status play(const Arguments& arguments) {
  auto config = cli::resolve_config(arguments.config);
  if (!config) return config.error();
  config->mode = execution::Mode::kSequential;
  const auto dataset = dataset::open_dataset({.path = arguments.data, .cameras = arguments.cameras});
  if (!dataset) return dataset.error();
  const auto vocabulary = storage::vocabulary_or_shipped("");
  if (!vocabulary) return vocabulary.error();
  system::System system(dataset->rig, *config, {.vocabulary = *vocabulary});
  LapTable table(system, dataset->frames.size() / static_cast<std::size_t>(arguments.laps));
  const TimeNs span = dataset->frames.back().time_ns - dataset->frames.front().time_ns;
  const TimeNs period = span + span / static_cast<TimeNs>(dataset->frames.size() - 1);
  std::size_t next = 0;
  for (int time = 0; time < arguments.times; ++time) {
    session::DatasetFrames source(*dataset, 4);
    while (auto item = source.next()) {
      image::ImageBundle images = std::move(item->images);
      images.id = FrameId(next++);
      images.time_ns += time * period;
      for (image::CameraImage& i : images.images) i.time_ns += time * period;
      if (const auto processed = system.process(images); !processed) return processed.error();
      table.after_frame();
    }
  }
  return {};
}

}  // namespace
}  // namespace bslam

int main(int argc, char** argv) {
  CLI::App app("growth of the map over laps");
  bslam::Arguments arguments;
  app.add_option("data", arguments.data, "recording of complete laps")->required();
  app.add_option("--laps", arguments.laps, "number of laps in the recording")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--times", arguments.times, "number of times the recording is played")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--cameras", arguments.cameras, "cameras of the rig to use, as for `bslam run` (default: all)")
      ->delimiter(',');
  bslam::cli::add_config_options(app, arguments.config);
  CLI11_PARSE(app, argc, argv);
  const bslam::Status status = bslam::play(arguments);
  if (!status) fmt::print(stderr, "{}\n", status.error().message());
  return status ? 0 : 2;
}
