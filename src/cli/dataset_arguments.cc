#include "cli/dataset_arguments.h"

#include <charconv>
#include <sstream>

namespace bslam::cli {
namespace {

Result<std::vector<int>> parse_cameras(const std::string& text) {
  std::vector<int> cameras;
  std::istringstream parts(text + ",");  // the added comma makes an empty last number an error as well
  for (std::string part; std::getline(parts, part, ',');) {
    int value = -1;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (error != std::errc() || end != part.data() + part.size() || value < 0) {
      return Error{"command line", "--cameras", "'" + text + "'", "camera numbers separated by commas, such as 0,1"};
    }
    cameras.push_back(value);
  }
  return cameras;
}

}  // namespace

void add_dataset_options(CLI::App& verb, DatasetArguments& a) {
  verb.add_option("DATA", a.path, "folder of the data set")->required();
  add_recording_options(verb, a);
}

void add_recording_options(CLI::App& verb, DatasetArguments& a) {
  verb.add_option("--format", a.format, "data set format")
      ->check(CLI::IsMember({"auto", "euroc", "kitti", "folder"}))
      ->capture_default_str();
  verb.add_option("--rig", a.rig, "calibration file; default: the calibration in DATA");
  verb.add_option("--cameras", a.cameras,
                  "cameras of the rig to use, in this order, such as 0,1; the first becomes camera 0 of the run");
  verb.add_option("--begin", a.begin_s, "start of the interval to process, in seconds after the first image");
  verb.add_option("--end", a.end_s, "end of the interval to process, in seconds after the first image");
}

Result<dataset::DatasetRequest> dataset_request(const DatasetArguments& a, double sync_tolerance_s) {
  dataset::DatasetRequest request;
  request.path = a.path;
  if (a.format == "euroc") request.format = dataset::DatasetFormat::kEuroc;
  if (a.format == "kitti") request.format = dataset::DatasetFormat::kKitti;
  if (a.format == "folder") request.format = dataset::DatasetFormat::kFolder;
  if (!a.rig.empty()) request.rig_file = a.rig;
  if (a.cameras) {
    auto cameras = parse_cameras(*a.cameras);
    if (!cameras) return cameras.error();
    request.cameras = std::move(*cameras);
  }
  request.sync_tolerance_s = sync_tolerance_s;
  request.begin_s = a.begin_s;
  request.end_s = a.end_s;
  return request;
}

}  // namespace bslam::cli
