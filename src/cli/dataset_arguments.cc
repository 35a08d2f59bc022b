#include "cli/dataset_arguments.h"

#include <charconv>
#include <map>

#include "base/split.h"

namespace bslam::cli {
namespace {

Result<std::vector<int>> parse_cameras(const std::string& text) {
  std::vector<int> cameras;
  for (const std::string& part : split(text, ',')) {
    int value = -1;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (error != std::errc() || end != part.data() + part.size() || value < 0) {
      return Error{"command line", "--cameras", "'" + text + "'", "camera numbers separated by commas, such as 0,1"};
    }
    cameras.push_back(value);
  }
  return cameras;
}

Result<std::vector<image_decoding::Bayer>> parse_bayer(const std::string& text) {
  using image_decoding::Bayer;
  static const std::map<std::string, Bayer> kPatterns = {{"none", Bayer::kNone},
                                                         {"rggb", Bayer::kRggb},
                                                         {"bggr", Bayer::kBggr},
                                                         {"grbg", Bayer::kGrbg},
                                                         {"gbrg", Bayer::kGbrg}};
  std::vector<Bayer> patterns;
  for (const std::string& part : split(text, ',')) {
    const auto pattern = kPatterns.find(part);
    if (pattern == kPatterns.end())
      return Error{"command line", "--bayer", "'" + text + "'",
                   "rggb, bggr, grbg, gbrg or none, for all cameras or separated by commas"};
    patterns.push_back(pattern->second);
  }
  return patterns;
}

}  // namespace

void add_image_options(CLI::App& verb, ImageArguments& a) {
  verb.add_option(
      "--topics", a.topics,
      "image topics of a bag, or folders with images in DATA, in the order of the rig's cameras, separated by "
      "commas; default: those that the rig file names, or all, by name");
  verb.add_flag("--side-by-side", a.side_by_side, "each image of the video consists of those of two cameras");
  verb.add_option("--rate", a.rate_hz, "frame rate in Hz; the time stamps of the images are frame numbers");
  verb.add_option("--stamp-unit", a.stamp_unit, "unit of the time stamps; default: ns")
      ->check(CLI::IsMember({"ns", "us", "ms", "s"}));
  verb.add_option("--bayer", a.bayer,
                  "colour filter of raw images: rggb, bggr, grbg, gbrg or none; one for all cameras, or one for each, "
                  "separated by commas");
  verb.add_option("--masks", a.masks,
                  "folder with masks, in which 0 marks pixels to ignore: camN.png for all images of camera N of the "
                  "recording, camN/STAMP.png for the image with this time stamp in ns");
  verb.add_option("--vignettes", a.vignettes,
                  "folder with vignettes camN.png, the relative brightness of the images of camera N of the recording, "
                  "which are corrected for it");
}

Status apply_image_options(const ImageArguments& a, dataset::DatasetRequest& request) {
  static const std::map<std::string, TimeNs> kUnits = {
      {"ns", 1}, {"us", 1'000}, {"ms", 1'000'000}, {"s", 1'000'000'000}};
  for (const std::string& topic : split(a.topics, ',')) {
    if (!topic.empty()) request.topics.push_back(topic);
  }
  request.side_by_side = a.side_by_side;
  request.time_stamps.rate_hz = a.rate_hz;
  if (!a.stamp_unit.empty()) request.time_stamps.unit_ns = kUnits.at(a.stamp_unit);
  if (!a.masks.empty()) request.masks = a.masks;
  if (!a.vignettes.empty()) request.vignettes = a.vignettes;
  if (a.bayer.empty()) return {};
  auto patterns = parse_bayer(a.bayer);
  if (!patterns) return patterns.error();
  request.bayer = *std::move(patterns);
  return {};
}

void add_dataset_options(CLI::App& verb, DatasetArguments& a) {
  verb.add_option("DATA", a.path,
                  "folder of a data set, ROS 1 bag, ROS 2 bag, MCAP file, or videos; several bags of one recording, or "
                  "a video of each camera, are joined by commas")
      ->required();
  add_recording_options(verb, a);
}

void add_recording_options(CLI::App& verb, DatasetArguments& a) {
  verb.add_option("--format", a.format, "data set format")
      ->check(CLI::IsMember({"auto", "euroc", "kitti", "folder", "bag", "video"}))
      ->capture_default_str();
  verb.add_option("--rig", a.rig, "calibration file; default: the calibration in DATA");
  verb.add_option("--cameras", a.cameras,
                  "cameras of the rig to use, in this order, such as 0,1; the first becomes camera 0 of the run");
  verb.add_option("--begin", a.begin_s, "start of the interval to process, in seconds after the first image");
  verb.add_option("--end", a.end_s, "end of the interval to process, in seconds after the first image");
  add_image_options(verb, a.images);
}

Result<dataset::DatasetRequest> dataset_request(const DatasetArguments& a, double sync_tolerance_s) {
  dataset::DatasetRequest request;
  request.path = a.path;
  using dataset::DatasetFormat;
  for (const DatasetFormat format : {DatasetFormat::kEuroc, DatasetFormat::kKitti, DatasetFormat::kFolder,
                                     DatasetFormat::kBag, DatasetFormat::kVideo}) {
    if (a.format == dataset::format_name(format)) request.format = format;
  }
  if (!a.rig.empty()) request.rig_file = a.rig;
  if (a.cameras) {
    auto cameras = parse_cameras(*a.cameras);
    if (!cameras) return cameras.error();
    request.cameras = std::move(*cameras);
  }
  request.sync_tolerance_s = sync_tolerance_s;
  request.begin_s = a.begin_s;
  request.end_s = a.end_s;
  if (const Status s = apply_image_options(a.images, request); !s) return s.error();
  return request;
}

}  // namespace bslam::cli
