// bslam rig: describes, checks, converts and estimates a rig calibration.
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/output_file.h"
#include "cli/dataset_arguments.h"
#include "cli/print_message.h"
#include "cli/verbs.h"
#include "dataset/rosbag2_folder.h"
#include "rig_formats/rig_file.h"
#include "session/rig_report.h"
#include "session/rig_source.h"

namespace bslam::cli {
namespace {

struct ConvertArguments {
  std::vector<std::string> files;  // the last one is written
  std::string to;
  std::vector<std::string> drop;
  std::string topics;
  bool overwrite = false;
};

std::string joined_formats() {
  std::string names;
  for (const rig_formats::RigFormat format : rig_formats::writable_formats())
    names += (names.empty() ? "" : ", ") + std::string(rig_formats::format_name(format));
  return names;
}

Result<camera::Rig> with_drops(camera::Rig rig, const std::vector<std::string>& drops) {
  static const std::map<std::string, rig_formats::Droppable> kDroppable = {
      {"body", rig_formats::Droppable::kBodyFrame},
      {"mask", rig_formats::Droppable::kMasks},
      {"rolling-shutter", rig_formats::Droppable::kRollingShutters},
      {"time-offset", rig_formats::Droppable::kTimeOffsets}};
  for (const std::string& drop : drops) {
    const auto what = kDroppable.find(drop);
    if (what == kDroppable.end()) return Error{"--drop", "", drop, "body, mask, rolling-shutter or time-offset"};
    rig = rig_formats::without(rig, what->second);
  }
  return rig;
}

struct InfoArguments {
  session::RigReportRequest report;
  ImageArguments images;
};

int rig_info(const InfoArguments& arguments) {
  session::RigReportRequest request = arguments.report;
  if (!request.svg.empty()) {
    for (const Status& s : {check_not_input(request.svg, "--svg", {request.file, request.images}),
                            check_output_file(request.svg, "--svg", true, "<svg ")})
      if (!s) return report_error(s.error());
  }
  if (const Status s = apply_image_options(arguments.images, request.recording); !s) return report_error(s.error());
  const auto report = session::report_rig(request);
  if (!report) return report_error(report.error());
  std::fputs(report->c_str(), stdout);
  return kExitOk;
}

// No calibration is replaced by its conversion.
Status check_converted(const std::vector<std::filesystem::path>& inputs,
                       const std::vector<std::filesystem::path>& outputs) {
  std::vector<std::filesystem::path> read;
  for (const std::filesystem::path& input : inputs) {
    const std::vector<std::filesystem::path> files = rig_formats::files_of_rig(input);
    read.insert(read.end(), files.begin(), files.end());
    if (const auto bag = dataset::files_of_rosbag2(input)) {
      read.insert(read.end(), bag->files.begin(), bag->files.end());
      read.push_back(input / "metadata.yaml");
    }
  }
  for (const std::filesystem::path& file : outputs) {
    if (Status other = check_not_input(file, "", read); !other) return other;
  }
  return {};
}

// Reads a calibration, or that of these topics of a recording.
Result<rig_formats::RigFile> read_input(const std::filesystem::path& file, const std::string& topics) {
  if (rig_formats::is_saved_map(file)) return rig_formats::read_rig_file(file);
  dataset::DatasetRequest recording{.path = file};
  ImageArguments images;
  images.topics = topics;
  if (const Status s = apply_image_options(images, recording); !s) return s.error();
  auto source = session::read_rig_source(recording);
  if (!source) return source.error();
  if (topics.empty() || source->of_recording) return std::move(source->file);
  return Error{"--topics", "", "a calibration file", "a recording, of which the topics are"};
}

int rig_convert(const ConvertArguments& arguments) {
  const std::vector<std::filesystem::path> inputs(arguments.files.begin(), arguments.files.end() - 1);
  const std::string& out = arguments.files.back();
  auto in = rig_formats::read_joined_rigs(
      inputs, [&](const std::filesystem::path& file) { return read_input(file, arguments.topics); });
  if (!in) return report_error(in.error());
  rig_formats::RigFormat format = rig_formats::format_of_output(out);
  if (!arguments.to.empty()) {
    const auto named = rig_formats::writable_format(arguments.to);
    if (!named) return report_error({"--to", "", arguments.to, "one of: " + joined_formats()});
    format = *named;
  }
  const auto rig = with_drops(std::move(in->rig), arguments.drop);
  if (!rig) return report_error(rig.error());
  if (const Status s = check_converted(inputs, rig_formats::files_written(format, out, rig->size())); !s)
    return report_error(s.error());
  const auto there = rig_formats::files_in_the_way(format, out);
  if (!there.empty() && !arguments.overwrite) {
    return report_error({there.front().string(), "", "an existing calibration", "a new name, or --overwrite"});
  }
  const auto notes = rig_formats::write_rig_as(*rig, format, out, in->topics);
  if (!notes) return report_error(notes.error());
  for (const std::string& note : in->notes) print_message("note: {}\n", note);
  for (const std::string& note : *notes) print_message("note: {}\n", note);
  std::printf("%s: %zu camera%s as %s\n", out.c_str(), rig->size(), rig->size() == 1 ? "" : "s",
              std::string(rig_formats::format_name(format)).c_str());
  return kExitOk;
}

void add_info(CLI::App& rig, int& exit_status) {
  const auto arguments = std::make_shared<InfoArguments>();
  session::RigReportRequest* const request = &arguments->report;
  CLI::App* info = rig.add_subcommand(
      "info", "print cameras, fields of view, baselines and overlaps, and warn about likely mistakes");
  info->add_option("FILE", request->file, "a calibration, the folder of a data set, or a saved map")->required();
  info->add_flag("--json", request->json, "print JSON");
  info->add_option("--svg", request->svg, "write a drawing of the rig from above and from the side to this SVG file");
  info->add_option("--images", request->images, "test the extrinsics against the images of this data set");
  add_image_options(*info, arguments->images);
  info->callback([arguments, &exit_status] { exit_status = rig_info(*arguments); });
}

void add_convert(CLI::App& rig, int& exit_status) {
  const auto arguments = std::make_shared<ConvertArguments>();
  CLI::App* convert = rig.add_subcommand("convert", "write a calibration in another format");
  convert
      ->add_option("IN... OUT", arguments->files,
                   "IN: a calibration, the folder of a data set, or a recording with CameraInfo; several are joined by "
                   "their common body frame. OUT: "
                   "a file (.json: basalt, else bslam), or a folder (euroc); the name of a new folder must end in /")
      ->required()
      ->expected(2, 100);
  convert->add_option("--to", arguments->to, "format of OUT: " + joined_formats());
  convert->add_option("--drop", arguments->drop,
                      "omit content that the format cannot store: body, mask, rolling-shutter, time-offset");
  convert->add_option("--topics", arguments->topics,
                      "image topics of the recording IN whose cameras are written, separated by commas; default: all");
  convert->add_flag("--overwrite", arguments->overwrite, "replace an existing calibration");
  convert->callback([arguments, &exit_status] { exit_status = rig_convert(*arguments); });
}

}  // namespace

void add_rig(CLI::App& app, int& exit_status) {
  CLI::App* rig = app.add_subcommand("rig", "describe, check, convert and estimate a rig calibration");
  rig->require_subcommand(1);
  add_info(*rig, exit_status);
  add_convert(*rig, exit_status);
  add_rig_calibrate(*rig, exit_status);
}

}  // namespace bslam::cli
