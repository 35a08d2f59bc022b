// bslam rig: describe, check and convert a rig calibration.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "cli/verbs.h"
#include "io/euroc_sensor.h"
#include "io/rig_description.h"
#include "io/rig_file.h"

namespace bslam::cli {
namespace {

struct RigArguments {
  std::string in, out;
  bool overwrite = false;
};

int rig_info(const std::string& file) {
  const auto rig = io::read_rig(file);
  if (!rig) return report_error(rig.error());
  std::fputs(io::describe_rig(*rig).c_str(), stdout);
  return kExitOk;
}

// A folder, or a name that ends like one, is written in EuRoC's layout; anything else is our YAML.
int rig_convert(const RigArguments& arguments) {
  constexpr double kRateHz = 20.0;  // EuRoC's files carry one; nothing reads it
  const std::string& out = arguments.out;
  const auto rig = io::read_rig(arguments.in);
  if (!rig) return report_error(rig.error());
  std::error_code error;
  const bool folder = out.ends_with('/') || std::filesystem::is_directory(out, error);
  const bool there = folder ? std::filesystem::exists(std::filesystem::path(out) / "mav0", error) : std::filesystem::exists(out, error);
  if (there && !arguments.overwrite) return report_error({out, "OUT", "a calibration there already", "a new name, or --overwrite"});
  const Status status = folder ? io::write_euroc_sensors(*rig, out, kRateHz) : io::write_rig(*rig, out);
  if (!status) return report_error(status.error());
  std::printf("%s: %zu cameras as %s\n", out.c_str(), rig->size(), folder ? "EuRoC sensor files" : "a bslam rig file");
  return kExitOk;
}

}  // namespace

void add_rig(CLI::App& app, int& exit_status) {
  const auto arguments = std::make_shared<RigArguments>();
  CLI::App* rig = app.add_subcommand("rig", "describe, check and convert a rig calibration");
  rig->require_subcommand(1);
  const std::string formats = "bslam rig file, EuRoC sensor.yaml or data folder, KITTI calib.txt or data folder";

  CLI::App* info = rig->add_subcommand("info", "cameras, fields of view, baselines and overlap");
  info->add_option("FILE", arguments->in, formats)->required();
  info->callback([arguments, &exit_status] { exit_status = rig_info(arguments->in); });

  CLI::App* convert = rig->add_subcommand("convert", "write a calibration in another format");
  convert->add_option("IN", arguments->in, formats)->required();
  convert->add_option("OUT", arguments->out, "a file (bslam rig file), or a folder, ending in / where it is new (EuRoC: mav0/camN/sensor.yaml)")
      ->required();
  convert->add_flag("--overwrite", arguments->overwrite, "OUT may exist");
  convert->callback([arguments, &exit_status] { exit_status = rig_convert(*arguments); });
}

}  // namespace bslam::cli
