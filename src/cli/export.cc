// bslam export: converts a trajectory to another format, frame and axes.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/verbs.h"
#include "evaluation/association.h"
#include "evaluation/trajectory_file.h"
#include "geometry/vertical_direction.h"
#include "map_export/selection.h"
#include "rig_formats/rig_file.h"
#include "storage/map_file.h"

namespace bslam::cli {
namespace {

namespace fs = std::filesystem;
using evaluation::Trajectory;
using geometry::SE3;

struct TrajectoryArguments {
  std::string file, out, format, frame, axes, stamps;
  std::optional<fs::path> rig, map, times;
  int camera = 0;  // of the rig file: camera 0 of the trajectory
  bool overwrite = false;
};

// Reads the rig, whose camera 0 becomes that of the trajectory.
Result<camera::Rig> rig_of_trajectory(const TrajectoryArguments& arguments, const std::string& needed_by) {
  if (!arguments.rig) return Error{"command line", needed_by, "no --rig", "--rig FILE, the calibration of the run"};
  auto rig = rig_formats::read_rig(*arguments.rig);
  if (!rig || arguments.camera == 0) return rig;
  if (static_cast<std::size_t>(arguments.camera) >= rig->size())
    return Error{arguments.rig->string(), "--camera", std::to_string(arguments.camera),
                 fmt::format("a camera number below {}", rig->size())};
  std::vector<int> order = {arguments.camera};
  for (int c = 0; c < static_cast<int>(rig->size()); ++c)
    if (c != arguments.camera) order.push_back(c);
  return rig->subset(order);
}

// T_cam0_frame of the frame of this name: the body or a camera.
Result<SE3> frame_in_cam0(const std::string& name, const TrajectoryArguments& arguments) {
  const auto rig = rig_of_trajectory(arguments, "--frame " + name);
  if (!rig) return rig.error();
  if (name == "body") return rig->body_from_cam(0).inverse();
  std::string names;
  for (std::size_t c = 0; c < rig->size(); ++c) {
    if (rig->camera(c).name == name) return rig->rig_from_cam(c);
    names += ", " + rig->camera(c).name;
  }
  return Error{"command line", "--frame", name, "cam0, body" + names};
}

// The rotation of the world's axes: that of the map if one is given, so that the path fits maps exported for ROS.
Result<SE3> upright_axes_of(const Trajectory& trajectory, const TrajectoryArguments& arguments) {
  if (!arguments.map) {
    std::vector<SE3> poses;
    for (const evaluation::TimedPose& pose : trajectory) poses.push_back(pose.T_world_frame);
    return geometry::upright_axes(poses);
  }
  const auto saved = storage::read_map(arguments.map->string());
  if (!saved) return saved.error();
  const auto selection = map_export::select_submap(saved->map, std::nullopt);
  if (!selection) return selection.error();
  return selection->T_upright_world;
}

// Recorded time stamps instead of capture times: without the time offset of camera 0.
Status restore_stamps(const TrajectoryArguments& arguments, Trajectory& trajectory) {
  if (arguments.stamps != "image") return {};
  const auto rig = rig_of_trajectory(arguments, "--stamps image");
  if (!rig) return rig.error();
  for (evaluation::TimedPose& pose : trajectory) pose.time_ns -= rig->camera(0).time_offset_ns;
  return {};
}

// The input is a trajectory of camera 0.
Result<Trajectory> converted(const TrajectoryArguments& arguments) {
  auto read = evaluation::read_trajectory(arguments.file, arguments.times);
  if (!read) return read;
  Trajectory trajectory = *std::move(read);
  SE3 T_upright_world, T_cam0_frame;
  if (arguments.axes == "ros") {
    const auto axes = upright_axes_of(trajectory, arguments);
    if (!axes) return axes.error();
    T_upright_world = *axes;
  }
  if (arguments.frame != "cam0") {
    const auto frame = frame_in_cam0(arguments.frame, arguments);
    if (!frame) return frame.error();
    T_cam0_frame = *frame;
  }
  if (arguments.axes == "ros" && arguments.frame != "body") {
    geometry::Matrix3d R_cam_ros;  // x forward, y left, z up in a camera's x right, y down, z forward
    R_cam_ros << 0, -1, 0, 0, 0, -1, 1, 0, 0;
    T_cam0_frame = T_cam0_frame * SE3(R_cam_ros, geometry::Vector3d::Zero());
  }
  trajectory = evaluation::moved_to_frame(trajectory, T_cam0_frame);
  for (evaluation::TimedPose& pose : trajectory) pose.T_world_frame = T_upright_world * pose.T_world_frame;
  if (const Status s = restore_stamps(arguments, trajectory); !s) return s.error();
  return trajectory;
}

// The frame that the first line of a trajectory of bslam names; cam0 if there is no such line.
std::string frame_in_file(const std::string& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  const std::size_t at = line.starts_with("# bslam trajectory") ? line.find(" frame=") : std::string::npos;
  return at == std::string::npos ? "cam0" : line.substr(at + 7, line.find(' ', at + 7) - at - 7);
}

int run_export(const TrajectoryArguments& arguments) {
  std::error_code error;
  if (fs::exists(arguments.out, error) && !arguments.overwrite)
    return report_error({arguments.out, "--out", "an existing file", "a new file, or --overwrite"});
  if (const std::string frame = frame_in_file(arguments.file); frame != "cam0")
    return report_error({arguments.file, "frame", frame, "a trajectory of cam0, as bslam run writes it"});
  const auto trajectory = converted(arguments);
  if (!trajectory) return report_error(trajectory.error());
  using enum evaluation::TrajectoryFormat;
  const auto format = arguments.format == "euroc" ? kEurocCsv : arguments.format == "kitti" ? kKitti : kTum;
  const std::string frame = arguments.axes == "ros" ? arguments.frame + "_ros" : arguments.frame;
  const std::string header =
      evaluation::trajectory_header(frame, evaluation::PoseState::kFinal, arguments.axes == "ros" ? "map" : "world");
  const Status status = evaluation::write_trajectory(arguments.out, *trajectory, format, header, arguments.overwrite);
  if (!status) return report_error(status.error());
  std::printf("%s: %zu poses\n", arguments.out.c_str(), trajectory->size());
  return kExitOk;
}

}  // namespace

void add_export(CLI::App& app, int& exit_status) {
  const auto arguments = std::make_shared<TrajectoryArguments>();
  CLI::App* verb = app.add_subcommand("export", "convert a trajectory to another format, frame or axes");
  verb->add_option("TRAJECTORY", arguments->file, "a trajectory of camera 0: TUM, EuRoC csv or KITTI")->required();
  verb->add_option("--out", arguments->out, "file to write")->required();
  verb->add_option("--format", arguments->format, "format of the file; default: tum")
      ->check(CLI::IsMember({"tum", "euroc", "kitti"}));
  verb->add_option("--frame", arguments->frame, "whose poses are written: cam0, body, or a camera; default: cam0")
      ->default_val("cam0");
  verb->add_option("--axes", arguments->axes,
                   "camera: as in the trajectory, x right, y down, z forward; ros: x forward, y left, z up, for the "
                   "world and for cameras; default: camera")
      ->check(CLI::IsMember({"camera", "ros"}));
  verb->add_option("--map", arguments->map,
                   "saved map of the run, whose vertical direction --axes ros uses instead of that of the trajectory");
  verb->add_option("--stamps", arguments->stamps,
                   "capture: times of capture, which include the time offset of camera 0; image: time stamps of its "
                   "images; default: capture")
      ->check(CLI::IsMember({"capture", "image"}));
  verb->add_option("--rig", arguments->rig, "calibration of the run, for --frame and --stamps image");
  verb->add_option("--camera", arguments->camera, "number in the rig file of the camera of the trajectory; default: 0")
      ->check(CLI::NonNegativeNumber);
  verb->add_option("--times", arguments->times, "times of KITTI poses; default: times.txt beside them");
  verb->add_flag("--overwrite", arguments->overwrite, "replace existing files");
  verb->callback([arguments, &exit_status] { exit_status = run_export(*arguments); });
}

}  // namespace bslam::cli
