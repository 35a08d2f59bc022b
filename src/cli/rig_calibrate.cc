// bslam rig calibrate: estimates a calibration from recordings, beginning with a rough one.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/atomic_file.h"
#include "base/output_file.h"
#include "camera/model_table.h"
#include "cli/config_arguments.h"
#include "cli/dataset_arguments.h"
#include "cli/interruption.h"
#include "cli/progress_bar.h"
#include "cli/verbs.h"
#include "dataset/recording_description.h"
#include "rig_formats/rig_file.h"
#include "session/rig_calibration.h"
#include "storage/vocabulary_file.h"

namespace bslam::cli {
namespace {

namespace fs = std::filesystem;

struct CalibrateArguments {
  std::vector<std::string> paths;
  DatasetArguments data;
  ConfigArguments config;
  std::string out, model, progress = "auto";
  std::optional<double> fov_deg;
  bool overwrite = false;
};

// The file must not be one of the input, and is replaced only if it is a calibration of any format.
Status check_out(const CalibrateArguments& a) {
  std::vector<fs::path> inputs(a.paths.begin(), a.paths.end());
  inputs.emplace_back(a.config.file);
  const std::vector<std::string> calibrations = a.data.rig.empty() ? a.paths : std::vector{a.data.rig};
  for (const std::string& calibration : calibrations) {
    const std::vector<fs::path> files = rig_formats::files_of_rig(calibration);
    inputs.insert(inputs.end(), files.begin(), files.end());
  }
  if (Status s = check_not_input(a.out, "--out", inputs); !s) return s;
  const bool is_calibration = rig_formats::read_rig_file(a.out).ok();
  return check_output_file(a.out, "--out", a.overwrite, is_calibration ? "" : "bslam_rig:");
}

// The start for the images of a single camera without a calibration, which needs no rig file: its model is that of the
// command line, and its resolution that of the images. nullopt for several cameras, and if something else is missing.
std::optional<camera::Rig> rig_of_single_camera(const dataset::DatasetRequest& request) {
  const auto recording = dataset::describe_recording(request);
  if (!recording || !recording->only_uncalibrated) return std::nullopt;
  const auto in_use = [](const dataset::StreamDescription& stream) { return stream.camera >= 0; };
  const auto stream = std::ranges::find_if(recording->streams, in_use);
  if (std::ranges::count_if(recording->streams, in_use) != 1 || stream->width <= 0) return std::nullopt;
  const double focal = stream->width;  // is replaced
  const auto model = camera::find_model(camera::Pinhole::kName)->make({focal, focal, 0, 0}, {});
  const camera::Camera camera{
      .name = "cam0", .model = model, .width = stream->width, .height = stream->height, .mask_file = {}};
  return camera::Rig({{camera, geometry::SE3()}});
}

// All recordings must be of one rig: that of --rig, or the first one's.
Result<std::vector<dataset::Dataset>> open_recordings(const CalibrateArguments& a, const system::Config& config) {
  std::vector<dataset::Dataset> out;
  for (const std::string& path : a.paths) {
    DatasetArguments one = a.data;
    one.path = path;
    auto request = dataset_request(one, config.io.sync_tolerance);
    if (!request) return request.error();
    auto opened = dataset::open_dataset(*request);
    if (!opened && a.fov_deg && one.rig.empty()) {
      request->rig_of_map = rig_of_single_camera(*request);
      if (request->rig_of_map) opened = dataset::open_dataset(*request);
    }
    if (!opened) return opened.error();
    const camera::Rig& first = out.empty() ? opened->rig : out.front().rig;
    if (opened->rig.size() != first.size() || !opened->rig.same_calibration(first))
      return Error{path, "", "another calibration than that of " + a.paths.front(),
                   "recordings of one rig, or --rig FILE"};
    out.push_back(*std::move(opened));
  }
  if (!a.fov_deg) return out;
  for (dataset::Dataset& recording : out) {
    auto rig = session::with_nominal_intrinsics(recording.rig, a.model, *a.fov_deg);
    if (!rig) return rig.error();
    if (recording.whole_rig)
      recording.whole_rig = recording.whole_rig->with_calibration_of(*rig, recording.cameras_used);
    recording.rig = *std::move(rig);
  }
  return out;
}

int rig_calibrate(const CalibrateArguments& a) {
  const Interruption interruption;
  const auto config = resolve_config(a.config, session::rig_calibration_config());
  if (!config) return report_error(config.error());
  const auto recordings = open_recordings(a, *config);
  if (!recordings) return report_error(recordings.error());
  if (const Status s = check_out(a); !s) return report_error(s.error());
  const auto vocabulary = storage::vocabulary_or_shipped("");
  if (!vocabulary) return report_error(vocabulary.error());
  ProgressBar bar(a.progress == "auto", "frames");
  const auto progress = [&bar](std::size_t done, std::size_t all) { bar.show(done, all); };
  const auto found = session::calibrate_rig(*recordings, {*config, *vocabulary, interruption.token(), progress});
  bar.finish();
  if (!found) {
    const int status = report_error(found.error());
    return interruption.token().stop_requested() ? kExitInterrupted : status;
  }
  const Status written = write_atomically(a.out, session::calibrated_rig_yaml(*found));
  if (!written) return report_error(written.error());
  std::printf("%s%s\n", session::calibration_text(*found).c_str(), a.out.c_str());
  return kExitOk;
}

}  // namespace

void add_rig_calibrate(CLI::App& rig, int& exit_status) {
  const auto a = std::make_shared<CalibrateArguments>();
  CLI::App* verb = rig.add_subcommand(
      "calibrate", "estimate the calibration from recordings of any scene, beginning with a rough one");
  verb->add_option("DATA", a->paths, "folders of one or several data sets of the same rig")->required();
  add_recording_options(*verb, a->data);
  CLI::Option* model = verb->add_option("--model", a->model, "begin with this camera model for all cameras")
                           ->check(CLI::IsMember({"pinhole", "pinhole-radtan", "kannala-brandt"}));
  CLI::Option* fov =
      verb->add_option("--fov", a->fov_deg,
                       "begin with this horizontal field of view in degrees, and without distortion; the "
                       "rig gives resolutions and extrinsics, and a single camera needs none");
  model->needs(fov);
  fov->needs(model);
  verb->add_option("--out", a->out, "rig file to write")->required();
  add_config_options(*verb, a->config);
  verb->add_option("--progress", a->progress, "auto: show a progress bar if stderr is a terminal; never: show none")
      ->check(CLI::IsMember({"auto", "never"}))
      ->capture_default_str();
  verb->add_flag("--overwrite", a->overwrite, "replace an existing file");
  verb->callback([a, &exit_status] { exit_status = rig_calibrate(*a); });
}

}  // namespace bslam::cli
