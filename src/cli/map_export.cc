// bslam map export: a saved map in formats of other programs.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/output_file.h"
#include "cli/dataset_arguments.h"
#include "cli/interruption.h"
#include "cli/print_message.h"
#include "cli/verbs.h"
#include "dataset/dataset.h"
#include "map/rigs_of_map.h"
#include "map_export/export_map.h"
#include "storage/map_file.h"

namespace bslam::cli {
namespace {

struct ExportArguments {
  std::string file, format, images, rig;
  ImageArguments image_options;
  std::vector<double> height;
  std::string up;
  map_export::ExportRequest request;
};

// A recording without a calibration has that of the map, if it is of one rig.
Result<dataset::Dataset> open_recording(const ExportArguments& arguments, const map::BundledMap& map) {
  constexpr double kTolerance_s = 0.1;  // includes images of cameras that are not synchronised
  dataset::DatasetRequest request{.path = arguments.images, .sync_tolerance_s = kTolerance_s};
  if (!arguments.rig.empty()) request.rig_file = arguments.rig;
  const std::vector<std::size_t> rigs = map::first_cameras_of_rigs(map);
  if (std::ranges::all_of(rigs, [](std::size_t first) { return first == 0; })) request.rig_of_map = map.given_rig();
  if (const Status s = apply_image_options(arguments.image_options, request); !s) return s.error();
  return dataset::open_dataset(request);
}

Status complete_request(ExportArguments& arguments) {
  map_export::ExportRequest& request = arguments.request;
  for (const map_export::FormatName& format : map_export::formats())
    if (format.name == arguments.format) request.format = format.format;
  if (!arguments.up.empty()) {
    const auto up = geometry::parse_up_axis(arguments.up);
    if (!up) return up.error();
    request.up = *up;
  }
  if (arguments.height.empty()) return {};
  if (request.format != map_export::Format::kNav2)
    return Error{"command line", "--height", "another format", "--format nav2"};
  if (!(arguments.height[0] < arguments.height[1]))
    return Error{"command line", "--height", "a band without height", "the lower limit first, such as -0.5 0.5"};
  request.band = {arguments.height[0], arguments.height[1]};
  return {};
}

// A file must not be one of the input, and is replaced only if it is of its kind. Folders are checked as they are
// written.
Status check_out(const ExportArguments& arguments) {
  const std::string out = arguments.request.out;
  if (Status s = check_not_input(out, "--out", {arguments.file, arguments.images, arguments.rig}); !s) return s;
  for (const map_export::FormatName& format : map_export::formats()) {
    if (format.format == arguments.request.format && !format.is_folder)
      return check_output_file(out, "--out", arguments.request.overwrite, format.begin);
  }
  return {};
}

int run_map_export(ExportArguments arguments) {
  if (const Status s = complete_request(arguments); !s) return report_error(s.error());
  if (const Status s = check_out(arguments); !s) return report_error(s.error());
  const auto saved = storage::read_map(arguments.file);
  if (!saved) return report_error(saved.error());
  std::optional<dataset::Dataset> data;
  if (!arguments.images.empty()) {
    auto opened = open_recording(arguments, saved->map);
    if (!opened) return report_error(opened.error());
    data = *std::move(opened);
  }
  arguments.request.data = data ? &*data : nullptr;
  arguments.request.data_folder = arguments.images;
  const Interruption interruption;
  arguments.request.interrupted = interruption.token();
  const auto report = map_export::export_map(saved->map, arguments.request);
  if (!report) {
    const int status = report_error(report.error());
    return interruption.token().stop_requested() ? kExitInterrupted : status;
  }
  for (const std::string& note : report->notes) print_message("note: {}\n", note);
  std::printf("%s: %s\n", arguments.request.out.c_str(), report->summary.c_str());
  return kExitOk;
}

}  // namespace

void add_map_export(CLI::App& map, int& exit_status) {
  const auto arguments = std::make_shared<ExportArguments>();
  map_export::ExportRequest& request = arguments->request;
  CLI::App* out = map.add_subcommand("export", "write a map in formats of other programs");
  out->add_option("FILE", arguments->file, "a saved map")->required();
  std::vector<std::string> names;
  for (const map_export::FormatName& format : map_export::formats()) names.emplace_back(format.name);
  out->add_option("--format", arguments->format,
                  "colmap, nerfstudio, nav2: a folder; ply, g2o, octomap: a file. Default: a folder with points.ply, "
                  "keyframes.tum, rig.yaml and a COLMAP text model")
      ->check(CLI::IsMember(names));
  out->add_option("--out", request.out, "folder or file to write")->required();
  out->add_option("--images", arguments->images, "recording of the map: for names of images and colours of points");
  add_image_options(*out, arguments->image_options);
  out->add_option("--rig", arguments->rig,
                  "calibration of the recording, as for bslam run; default: that in it, or else that of the map");
  out->add_flag("--undistort", request.undistort,
                "colmap, nerfstudio: write undistorted images of the keyframes, with pinhole cameras");
  out->add_option("--submap", request.submap,
                  "number of the submap to export, as in bslam map info; default: the one with most landmarks")
      ->check(CLI::NonNegativeNumber);
  out->add_option("--resolution", request.resolution, "octomap, nav2: side of a cell in metres")
      ->check(CLI::Range(1e-4, 1e4));
  out->add_option("--max-range", request.max_range, "octomap, nav2: length of rays in metres")
      ->check(CLI::Range(1e-4, 1e6));
  out->add_option("--height", arguments->height,
                  "nav2: lower and upper limit of obstacles, in metres above camera 0; default: -0.5 0.5")
      ->expected(2);
  out->add_option("--up", arguments->up,
                  "nerfstudio, octomap, nav2: the axis that points upward, such as body:z, camera:-y (of camera 0) or "
                  "world:0,-1,0.2 (of the trajectory); default: that of camera 0's images");
  out->add_flag("--overwrite", request.overwrite, "replace an existing file, or write into a folder that is not empty");
  out->callback([arguments, &exit_status] { exit_status = run_map_export(*arguments); });
}

}  // namespace bslam::cli
