// bslam live: runs the SLAM system on the images of live cameras.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/output_file.h"
#include "base/split.h"
#include "capture/live_cameras.h"
#include "capture/pixels.h"
#include "capture/played_folders.h"
#include "capture/recorder.h"
#include "capture/v4l2_device.h"
#include "capture/video_modes.h"
#include "cli/interruption.h"
#include "cli/print_message.h"
#include "cli/progress_bar.h"
#include "cli/run_messages.h"
#include "cli/shell_command.h"
#include "cli/slam_run.h"
#include "cli/verbs.h"
#include "rig_formats/rig_file.h"
#include "session/run_warnings.h"

namespace bslam::cli {
namespace {

struct LiveArguments {
  SlamArguments slam;
  std::string cameras, record, exposure, pixels;
  std::optional<double> fps, duration_s;
  bool list = false;
};

// The cameras in use: those of the rig that have a device.
struct LiveRig {
  camera::Rig rig, whole;
  std::vector<int> cameras;
  std::vector<std::string> paths;
};

Error required(const char* option, const char* expected) { return {"command line", option, "nothing", expected}; }

Status check_required(const LiveArguments& a) {
  if (a.slam.rig.empty()) return required("--rig", "the calibration of the cameras");
  if (a.cameras.empty()) {
    return required("--cameras",
                    "the devices of the cameras, such as /dev/video0,/dev/video2; bslam live --list shows "
                    "them");
  }
  if (a.slam.out.empty()) return required("--out", "the folder for the output");
  return {};
}

Result<LiveRig> read_live_rig(const LiveArguments& a) {
  auto whole = rig_formats::read_rig(a.slam.rig);
  if (!whole) return whole.error();
  const std::vector<std::string> parts = split(a.cameras, ',');
  if (parts.size() != whole->size()) {
    return Error{"command line", "--cameras", fmt::format("{} device{}", parts.size(), parts.size() == 1 ? "" : "s"),
                 fmt::format("one for each of the {} cameras of {}, in its order; - for one that is not used",
                             whole->size(), a.slam.rig)};
  }
  LiveRig out{*whole, *whole, {}, {}};
  for (std::size_t c = 0; c < parts.size(); ++c) {
    if (parts[c] == "-") continue;
    if (std::ranges::find(out.paths, parts[c]) != out.paths.end())
      return Error{"command line", "--cameras", parts[c] + " twice", "each device once"};
    out.cameras.push_back(static_cast<int>(c));
    out.paths.push_back(parts[c]);
  }
  if (out.cameras.empty()) return Error{"command line", "--cameras", "no device", "one device or more"};
  out.rig = whole->subset(out.cameras);
  if (a.record.empty()) return out;
  auto recorded = capture::rig_as_recorded(out.rig);
  if (!recorded) return recorded.error();
  out.rig = *std::move(recorded);
  return out;
}

TimeNs now_ns(clockid_t clock) {
  timespec now{};
  ::clock_gettime(clock, &now);
  return static_cast<TimeNs>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

Result<capture::StreamRequest> stream_request(const LiveArguments& a) {
  capture::StreamRequest request;
  request.fps = a.fps;
  // Time stamps of the drivers are those of a clock that begins with the start of the computer. They are moved to the
  // time of day by a constant, so that a clock that is set during the run does not move them.
  request.clock_offset_ns = now_ns(CLOCK_REALTIME) - now_ns(CLOCK_MONOTONIC);
  if (a.exposure == "auto") request.exposure = capture::StreamRequest::Exposure::kAutomatic;
  if (!a.exposure.empty() && a.exposure != "auto") {
    request.exposure = capture::StreamRequest::Exposure::kFixed;
    const char* end = a.exposure.data() + a.exposure.size();
    const auto [rest, error] = std::from_chars(a.exposure.data(), end, request.exposure_us);
    if (error != std::errc() || rest != end || request.exposure_us < 1)
      return Error{"command line", "--exposure", "'" + a.exposure + "'", "auto, or microseconds"};
  }
  for (const capture::FourCc pixels : capture::pixel_formats()) {
    if (capture::fourcc_text(pixels) == a.pixels) request.pixels = pixels;
  }
  return request;
}

std::vector<std::string> pixel_names() {
  std::vector<std::string> out;
  for (const capture::FourCc pixels : capture::pixel_formats()) out.push_back(capture::fourcc_text(pixels));
  return out;
}

bool is_folder(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error);
}

// Folders of images are played in place of cameras.
capture::OpenDevice opener(const std::vector<std::string>& paths) {
  if (std::ranges::any_of(paths, is_folder)) return capture::play_folders(paths);
  return [](const std::string& path) { return capture::open_v4l2(capture::system_calls(), path); };
}

void print_cameras(const LiveRig& rig, const std::vector<capture::Stream>& streams) {
  for (std::size_t c = 0; c < streams.size(); ++c) {
    const capture::Stream& s = streams[c];
    print_message("{} = {}: {} {}x{}{}\n", rig.rig.camera(c).name, rig.paths[c], capture::fourcc_text(s.pixels),
                  s.width, s.height, s.fps ? fmt::format(", {:.4g} frames/s", *s.fps) : "");
  }
}

// Calls a function after some time, unless it is destroyed before.
class Timer {
 public:
  Timer(double seconds, std::function<void()> call)
      : thread_([this, seconds, call = std::move(call)](const std::stop_token& stop) {
          std::unique_lock lock(mutex_);
          over_.wait_for(lock, stop, std::chrono::duration<double>(seconds), [&stop] { return stop.stop_requested(); });
          if (!stop.stop_requested()) call();
        }) {}

 private:
  std::mutex mutex_;
  std::condition_variable_any over_;
  std::jthread thread_;
};

// Returns the warning if the recording ended early.
std::optional<std::string> end_recording(capture::Recorder& recorder, const std::string& file) {
  std::optional<std::string> warning;
  if (const Status written = recorder.finish(); !written)
    warning = written.error().message() + "; the recording ends there";
  if (warning) print_message("warning: {}\n", *warning);
  print_message("recorded: {} frames, {:.1f} MB in {}\n", recorder.frames(),
                1e-6 * static_cast<double>(recorder.bytes()), file);
  return warning;
}

dataset::Dataset dataset_of(const LiveRig& rig, TimeNs first_time_ns) {
  return {.name = "live",
          .format = dataset::DatasetFormat::kFolder,
          .rig = rig.rig,
          .cameras_used = rig.cameras,
          .whole_rig = rig.whole,
          .first_time_ns = first_time_ns,
          .frames = {},
          .ground_truth = {},
          .warnings = {},
          .sources = rig.paths};
}

Result<std::unique_ptr<capture::Recorder>> start_recording(const std::string& file, const LiveRig& rig,
                                                           capture::LiveCameras& cameras) {
  std::vector<bool> jpeg;
  for (const capture::Stream& stream : cameras.streams()) jpeg.push_back(capture::is_jpeg(stream.pixels));
  auto recorder = capture::Recorder::create(file, rig.rig, rig.cameras, jpeg);
  if (recorder) cameras.record_to(recorder->get());
  return recorder;
}

int run_live(const LiveArguments& a, const system::Config& config, const LiveRig& rig, const Interruption& interruption,
             capture::LiveCameras& cameras) {
  const bool quiet = log_verbosity(a.slam.log_level) < LogVerbosity::kWarning;
  session::RunControl control;
  // The first signal ends the capture, a second one the work on the map after it.
  const std::stop_callback on_signal(interruption.token(), [&] {
    cameras.stop();
    control.resume();
  });
  if (!quiet) print_cameras(rig, cameras.streams());
  const auto first_time_ns = cameras.wait_for_first_frame();
  if (interruption.token().stop_requested()) return kExitInterrupted;
  if (!first_time_ns) return report_error(first_time_ns.error());
  dataset::Dataset dataset = dataset_of(rig, *first_time_ns);

  std::unique_ptr<capture::Recorder> recorder;
  std::optional<Timer> timer;
  ProgressBar bar(a.slam.progress == "auto", "frames");
  const std::string images = a.record.empty() ? "RECORDING" : a.record;
  RunInput input{config, dataset, {}, shell_command({"bslam", "rig", "info", a.slam.rig, "--images", images})};
  input.options.source = &cameras;
  input.options.interrupted = interruption.second();
  input.options.progress = [&bar](std::size_t done, std::size_t all) { bar.show(done, all); };
  input.before = [&]() -> Status {
    if (!quiet) print_warnings(session::warnings_before_run(dataset));
    cameras.begin();
    if (a.duration_s) timer.emplace(*a.duration_s, [&cameras] { cameras.stop(); });
    const auto first_of_run_ns = cameras.wait_for_frame();
    dataset.first_time_ns = first_of_run_ns.value_or(*first_time_ns);
    if (a.record.empty() || !first_of_run_ns) return {};  // an earlier recording stays if there is no frame
    auto started = start_recording(a.record, rig, cameras);
    if (!started) return started.error();
    recorder = *std::move(started);
    return {};
  };
  input.after = [&] {
    bar.finish();
    timer.reset();
    cameras.stop();
    std::vector<std::string> warnings = cameras.notes();
    if (!quiet) print_warnings(warnings);
    const auto early = recorder ? end_recording(*recorder, a.record) : std::nullopt;
    if (early) warnings.push_back(*early);
    return warnings;
  };
  return run_and_write(a.slam, std::move(input), control);
}

// Folders of images have no settings.
Status check_settings_of_cameras(const LiveArguments& a, const std::vector<std::string>& paths) {
  const auto folder = std::ranges::find_if(paths, is_folder);
  if (folder == paths.end()) return {};
  for (const auto& [option, given] :
       {std::pair("--fps", a.fps.has_value()), std::pair("--exposure", !a.exposure.empty()),
        std::pair("--pixels", !a.pixels.empty())}) {
    if (given) return Error{"command line", option, "the folder " + *folder, "cameras, of which this can be set"};
  }
  return {};
}

Status check_recording(const LiveArguments& a) {
  if (!a.record.empty() && std::filesystem::path(a.record).extension() != ".mcap")
    return Error{"command line", "--record", a.record, "the name of an MCAP file, which ends in .mcap"};
  return check_output_file(a.record, "--record", a.slam.overwrite, "\x89MCAP");
}

int live(const LiveArguments& a) {
  if (a.list) {
    const std::string text = capture::devices_text(capture::system_calls());
    fmt::print("{}", text.empty() ? "no video devices\n" : text);
    return kExitOk;
  }
  const Interruption interruption;
  if (const Status s = check_required(a); !s) return report_error(s.error());
  const auto config = resolve_run_config(a.slam);
  if (!config) return report_error(config.error());
  const auto rig = read_live_rig(a);
  if (!rig) return report_error(rig.error());
  const auto request = stream_request(a);
  if (!request) return report_error(request.error());
  for (const Status& s : {check_settings_of_cameras(a, rig->paths), check_recording(a),
                          check_outputs(a.slam, {{"--record", a.record}})}) {
    if (!s) return report_error(s.error());
  }
  const bool quiet = log_verbosity(a.slam.log_level) < LogVerbosity::kWarning;
  capture::LiveOptions options{.paths = rig->paths,
                               .request = *request,
                               .open = opener(rig->paths),
                               .sync_tolerance_s = config->io.sync_tolerance};
  if (!quiet) options.say = [](const std::string& line) { print_message("warning: {}\n", line); };
  auto cameras = capture::LiveCameras::open(rig->rig, std::move(options));
  if (!cameras) return report_error(cameras.error());
  return run_live(a, *config, *rig, interruption, **cameras);
}

}  // namespace

void add_live(CLI::App& app, std::span<const char* const> command_line, int& exit_status) {
  const auto a = std::make_shared<LiveArguments>();
  a->slam.command = command_of(command_line);
  CLI::App* verb = app.add_subcommand("live", "run the SLAM system on cameras (Video4Linux) until Ctrl-C");
  verb->add_flag("--list", a->list, "show the cameras of this computer with their formats, sizes and rates, and end");
  verb->add_option("--rig", a->slam.rig, "calibration file; its resolutions are asked from the cameras");
  verb->add_option("--cameras", a->cameras,
                   "devices of the cameras of the rig, in its order, separated by commas, such as "
                   "/dev/video0,/dev/video2; - for a camera that is not used. Folders of images are played in place of "
                   "cameras");
  verb->add_option("--record", a->record,
                   "write the images of all processed frames to this MCAP file, from which bslam run creates the same "
                   "frames");
  verb->add_option("--fps", a->fps, "frame rate to set; default: the highest up to 60 that the camera offers")
      ->check(CLI::Range(0.1, 1000.0));
  verb->add_option("--exposure", a->exposure,
                   "auto, or a fixed exposure time in microseconds; default: as it is set already");
  verb->add_option("--pixels", a->pixels, "pixel format; default: the one that needs least conversion at this rate")
      ->check(CLI::IsMember(pixel_names()));
  verb->add_option("--duration", a->duration_s, "end after this many seconds; default: at Ctrl-C")
      ->check(CLI::Range(0.001, 1e9));
  add_slam_options(*verb, a->slam);
  verb->get_option("--out")->required(false);
  verb->callback([a, &exit_status] { exit_status = live(*a); });
}

}  // namespace bslam::cli
