// bslam export: converts a trajectory to another format, frame and axes.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/output_file.h"
#include "camera/camera_name.h"
#include "cli/print_message.h"
#include "cli/trajectory_camera.h"
#include "cli/verbs.h"
#include "evaluation/association.h"
#include "evaluation/trajectory_file.h"
#include "geometry/up_axis.h"
#include "geometry/vertical_direction.h"
#include "map_export/export_map.h"
#include "map_export/selection.h"
#include "rig_formats/rig_file.h"
#include "storage/map_file.h"

namespace bslam::cli {
namespace {

namespace fs = std::filesystem;
using evaluation::Trajectory;
using geometry::SE3;

struct TrajectoryArguments {
  std::string file, out, format, frame, axes, stamps, up;
  std::optional<fs::path> rig, map, times;
  std::optional<int> camera;  // camera of the rig file whose poses the trajectory contains
  bool overwrite = false;
};

// The arguments and the comments of the trajectory.
struct ExportInput : TrajectoryArguments {
  evaluation::TrajectoryComments comments;
};

// The frame of the poses in the file. If it does not name one, or cam0, --camera decides.
std::string frame_in_file(const ExportInput& input) {
  const std::string frame = input.camera ? input.comments.frame : input.comments.frame_of_poses();
  return frame.empty() || frame == "cam0" ? "cam" + std::to_string(input.camera.value_or(0)) : frame;
}

// The calibration, and the camera whose poses the trajectory contains. Poses of the body are converted to camera 0
// first.
struct TrajectoryRig {
  camera::Rig rig;
  std::size_t camera = 0;
};

Result<TrajectoryRig> rig_of_trajectory(const ExportInput& input, const std::string& needed_by) {
  if (!input.rig) return Error{"command line", needed_by, "no --rig", "--rig FILE, the calibration of the run"};
  auto rig = rig_formats::read_rig(*input.rig);
  if (!rig) return rig.error();
  if (frame_in_file(input) == "body") return TrajectoryRig{*std::move(rig), 0};
  const auto camera = camera_of_trajectory(input.file, input.comments, *rig, *input.rig, input.camera);
  if (!camera) return camera.error();
  return TrajectoryRig{*std::move(rig), *camera};
}

// T_cam_frame of the frame of this name, the body or a camera, and of the camera of the trajectory.
Result<SE3> frame_in_camera(const std::string& name, const ExportInput& input) {
  const auto source = rig_of_trajectory(input, "--frame " + name);
  if (!source) return source.error();
  const auto& [rig, camera] = *source;
  if (name == "body") return rig.body_from_first(camera).inverse();
  if (const auto target = name == "cam0" ? std::size_t{0} : camera::camera_named(name, rig))
    return rig.rig_from_first(camera).inverse() * rig.rig_from_first(*target);
  std::string names = "body, cam0";
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (rig.camera(c).name != "cam0") names += ", " + rig.camera(c).name;
  }
  return Error{"command line", "--frame", name, names};
}

// T_body_cam of the camera of the trajectory, where an upward axis of the body needs it.
Result<SE3> camera_on_body(const geometry::UpAxis& up, const ExportInput& input) {
  if (up.frame != geometry::UpAxis::Frame::kBody) return SE3();
  const auto source = rig_of_trajectory(input, "--up " + input.up);
  if (!source) return source.error();
  return source->rig.body_from_first(source->camera);
}

// The rotation of the world's axes: that of the map if one is given, so that the path fits maps exported for ROS.
Result<SE3> upright_axes_of(const Trajectory& trajectory, const ExportInput& input) {
  std::optional<geometry::UpAxis> up;
  if (!input.up.empty()) {
    const auto parsed = geometry::parse_up_axis(input.up);
    if (!parsed) return parsed.error();
    up = *parsed;
  } else {
    print_message("note: {}\n", map_export::upward_note());
  }
  if (!input.map) {
    std::vector<SE3> poses;
    for (const evaluation::TimedPose& pose : trajectory) poses.push_back(pose.T_world_frame);
    if (!up) return geometry::upright_axes(poses);
    const auto T_body_cam = camera_on_body(*up, input);
    if (!T_body_cam) return T_body_cam.error();
    const auto up_world = geometry::up_in_world(*up, poses, *T_body_cam);
    if (!up_world) return up_world.error();
    return geometry::upright_axes(poses, *up_world);
  }
  const auto saved = storage::read_map(input.map->string());
  if (!saved) return saved.error();
  const auto selection = map_export::select_submap(saved->map, std::nullopt, up);
  if (!selection) return selection.error();
  return selection->T_upright_world;
}

// Whether the times that are written are those that the images were recorded with.
bool writes_image_stamps(const ExportInput& input) {
  return input.stamps == "image" || (input.stamps.empty() && input.comments.image_stamps);
}

// Subtracts the time offset of the camera, or adds it, if the times of the input are not those that are written.
Status convert_stamps(const ExportInput& input, Trajectory& trajectory) {
  const bool image_stamps = writes_image_stamps(input);
  if (image_stamps == input.comments.image_stamps) return {};
  const auto source = rig_of_trajectory(input, "--stamps " + input.stamps);
  if (!source) return source.error();
  const TimeNs offset_ns = source->rig.camera(source->camera).time_offset_ns;
  for (evaluation::TimedPose& pose : trajectory) pose.time_ns += image_stamps ? -offset_ns : offset_ns;
  return {};
}

// Whose poses are written: by default those of the input.
std::string frame_of_output(const ExportInput& input) {
  return input.frame.empty() ? frame_in_file(input) : input.frame;
}

// T_file_cam of the poses in the file: the pose of camera 0 on the body if they are those of the body.
Result<SE3> camera_in_file(const ExportInput& input) {
  if (frame_in_file(input) != "body") return SE3();
  const auto source = rig_of_trajectory(input, "poses of the body");
  if (!source) return source.error();
  return source->rig.body_from_first(source->camera);
}

// T_cam_frame of the requested frame and of the camera of the trajectory. `T_file_cam`: see camera_in_file.
Result<SE3> wanted_frame(const ExportInput& input, const SE3& T_file_cam) {
  const std::string frame = frame_of_output(input), own = frame_in_file(input);
  if (own == "body" && frame == own) return T_file_cam.inverse();
  if (input.frame.empty() || (!input.camera && frame == own)) return SE3();
  const auto T_cam_frame = frame_in_camera(frame, input);
  const double distance_m = T_cam_frame ? (T_file_cam * *T_cam_frame).translation().norm() : 0;
  if (distance_m > 0 && input.comments.scale != "metric") {
    print_message(
        "note: the {} is {:.3f} m away from {}, but the unit of {} is not the metre: the distance is added to the path "
        "as it is\n",
        own == "body" ? "body" : "camera", distance_m, frame, input.file);
  }
  return T_cam_frame;
}

Result<Trajectory> converted(const ExportInput& input) {
  const auto read = evaluation::read_trajectory(input.file, input.times);
  if (!read) return read.error();
  const auto T_file_cam = camera_in_file(input);
  if (!T_file_cam) return T_file_cam.error();
  Trajectory trajectory = evaluation::moved_to_frame(*read, *T_file_cam);
  SE3 T_upright_world;
  if (input.axes == "ros") {
    const auto axes = upright_axes_of(trajectory, input);
    if (!axes) return axes.error();
    T_upright_world = *axes;
  }
  const auto frame = wanted_frame(input, *T_file_cam);
  if (!frame) return frame.error();
  SE3 T_cam_frame = *frame;
  if (input.axes == "ros" && frame_of_output(input) != "body") {
    geometry::Matrix3d R_cam_ros;  // x forward, y left, z up in a camera's x right, y down, z forward
    R_cam_ros << 0, -1, 0, 0, 0, -1, 1, 0, 0;
    T_cam_frame = T_cam_frame * SE3(R_cam_ros, geometry::Vector3d::Zero());
  }
  trajectory = evaluation::moved_to_frame(trajectory, T_cam_frame);
  for (evaluation::TimedPose& pose : trajectory) pose.T_world_frame = T_upright_world * pose.T_world_frame;
  if (const Status s = convert_stamps(input, trajectory); !s) return s.error();
  return trajectory;
}

// The world of the exported poses. Upright axes without a map are those of this trajectory only.
std::string parent_frame(const ExportInput& input) {
  if (input.axes != "ros") return input.comments.parent;
  return input.map ? "map" : input.comments.parent + "_ros";
}

// The comments of the exported file. If lengths are not metres in the source, they are not metres here either.
std::string header_of(const ExportInput& input, const std::string& frame) {
  evaluation::TrajectoryComments out = input.comments;
  out.frame = input.axes == "ros" ? frame + "_ros" : frame;
  out.parent = parent_frame(input);
  out.image_stamps = writes_image_stamps(input);
  return evaluation::text_of(out);
}

// Neither the trajectory nor another file of the input is replaced.
Status check_out(const TrajectoryArguments& a) {
  const fs::path times = evaluation::times_of_poses(a.file, a.times).value_or("");
  std::vector<std::string> outputs = {a.out};
  if (a.format == "kitti") outputs.push_back(evaluation::times_beside(a.out));
  for (const std::string& out : outputs) {
    Status other =
        check_not_input(out, "--out", {a.file, a.rig.value_or(""), a.map.value_or(""), a.times.value_or(""), times});
    if (!other) return other;
  }
  return check_new_file(a.out, a.overwrite);
}

// Poses of the body are converted by the rig; those with other axes are not.
Status check_frame(const ExportInput& input) {
  const std::string frame = frame_in_file(input);
  if (frame.ends_with("_ros"))
    return Error{input.file, "frame", frame, "a trajectory of a camera, as bslam run writes it"};
  if (frame == "body" && (!input.rig || input.camera))
    return Error{input.file, "frame", frame,
                 "a trajectory of a camera, as bslam run writes it, or --rig FILE without --camera"};
  return {};
}

int run_export(const TrajectoryArguments& arguments) {
  if (const Status s = check_out(arguments); !s) return report_error(s.error());
  const ExportInput input = {arguments, evaluation::read_comments(arguments.file)};
  if (const Status s = check_frame(input); !s) return report_error(s.error());
  if (!arguments.up.empty() && arguments.axes != "ros")
    return report_error({"command line", "--up", "no --axes ros", "--axes ros"});
  const auto trajectory = converted(input);
  if (!trajectory) return report_error(trajectory.error());
  using enum evaluation::TrajectoryFormat;
  const auto format = arguments.format == "euroc" ? kEurocCsv : arguments.format == "kitti" ? kKitti : kTum;
  const std::string header = header_of(input, frame_of_output(input));
  const Status status = evaluation::write_trajectory(arguments.out, *trajectory, format, header, arguments.overwrite);
  if (!status) return report_error(status.error());
  std::printf("%s: %zu pose%s\n", arguments.out.c_str(), trajectory->size(), trajectory->size() == 1 ? "" : "s");
  return kExitOk;
}

}  // namespace

void add_export(CLI::App& app, int& exit_status) {
  const auto arguments = std::make_shared<TrajectoryArguments>();
  CLI::App* verb = app.add_subcommand("export", "convert a trajectory to another format, frame or axes");
  verb->add_option("TRAJECTORY", arguments->file,
                   "poses of a camera, or with --rig of the body: TUM, EuRoC csv or KITTI")
      ->required();
  verb->add_option("--out", arguments->out, "file to write")->required();
  verb->add_option("--format", arguments->format, "format of the file; default: tum")
      ->check(CLI::IsMember({"tum", "euroc", "kitti"}));
  verb->add_option("--frame", arguments->frame,
                   "whose poses are written: body, or a camera; default: as in the trajectory");
  verb->add_option("--axes", arguments->axes,
                   "camera: as in the trajectory, x right, y down, z forward; ros: x forward, y left, z up, for the "
                   "world and for cameras; default: camera")
      ->check(CLI::IsMember({"camera", "ros"}));
  verb->add_option("--map", arguments->map,
                   "saved map of the run, whose vertical direction --axes ros uses instead of that of the trajectory");
  verb->add_option("--up", arguments->up,
                   "with --axes ros: the axis that points upward, such as body:z, camera:-y (of the camera of the "
                   "trajectory) or world:0,-1,0.2; default: that of the camera's images");
  verb->add_option("--stamps", arguments->stamps,
                   "capture: times of capture, which include the time offset of camera 0; image: time stamps of its "
                   "images; default: as in the trajectory")
      ->check(CLI::IsMember({"capture", "image"}));
  verb->add_option("--rig", arguments->rig, "calibration of the run, for --frame and --stamps");
  verb->add_option("--camera", arguments->camera,
                   "number in the rig file of the camera of the trajectory; default: the one that the trajectory names")
      ->check(CLI::NonNegativeNumber);
  verb->add_option("--times", arguments->times, "times of KITTI poses; default: times.txt beside them");
  verb->add_flag("--overwrite", arguments->overwrite, "replace existing files");
  verb->callback([arguments, &exit_status] { exit_status = run_export(*arguments); });
}

}  // namespace bslam::cli
