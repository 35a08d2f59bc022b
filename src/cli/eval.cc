// bslam eval: errors of an estimated trajectory with respect to ground truth.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/atomic_file.h"
#include "cli/print_message.h"
#include "cli/trajectory_camera.h"
#include "cli/verbs.h"
#include "evaluation/trajectory_error.h"
#include "evaluation/trajectory_file.h"
#include "report/plot_file.h"
#include "report/trajectory_plot.h"
#include "rig_formats/rig_file.h"

namespace bslam::cli {

namespace {

using evaluation::AlignMode;
using evaluation::Trajectory;
using evaluation::TrajectoryEvaluation;

struct EvalArguments {
  std::string estimate, ground_truth;
  std::string align = "se3";
  std::string gt_frame = "cam0";
  double max_dt_s = 0.01;
  double delta_s = 1.0;
  std::optional<int> camera;
  std::optional<std::filesystem::path> rig, plot, times;
  bool json = false;
};

// The arguments and the comments of the files that they name.
struct EvalInput : EvalArguments {
  evaluation::TrajectoryComments of_estimate, of_truth;
};

AlignMode align_mode(const std::string& name) {
  if (name == "sim3") return AlignMode::kSim3;
  return name == "none" ? AlignMode::kNone : AlignMode::kSe3;
}

// A calibration without a body has that of camera 0.
void note_of_body(const camera::Rig& rig, const std::filesystem::path& file) {
  const geometry::SE3& T_body_cam0 = rig.body_from_cam(0);
  if (!T_body_cam0.matrix().isIdentity(0)) return;
  print_message(
      "note: {} gives camera 0 no pose on the body other than the identity: the body is taken to be camera 0\n",
      file.string());
}

Status check_plot(const EvalArguments& a) {
  if (!a.plot) return {};
  return report::check_plot_file(*a.plot, "command line", "--plot",
                                 {a.estimate, a.ground_truth, a.rig.value_or(""), a.times.value_or("")});
}

// The frame of the poses of the estimate; empty if it is not known.
std::string frame_of_estimate(const EvalInput& input) {
  return input.camera ? input.of_estimate.frame : input.of_estimate.frame_of_poses();
}

// Whether the ground truth is an EuRoC csv with poses of the body, as that of EuRoC itself.
bool is_euroc_truth(const EvalInput& input) {
  return input.of_truth.euroc_csv && input.of_truth.frame_of_poses() == "body";
}

// What is not known from the files about the frames of their poses.
void note_of_frames(const EvalInput& input) {
  const bool of_body = frame_of_estimate(input) == "body";
  if (of_body && input.of_estimate.frame.empty()) {
    print_message(
        "note: the poses of {}, which is an EuRoC csv, are taken to be those of the body; --rig FILE --camera N says "
        "that they are those of a camera\n",
        input.estimate);
  }
  if (!of_body && input.gt_frame == "cam0" && is_euroc_truth(input)) {
    print_message(
        "note: EuRoC ground truth contains poses of the body; use --gt-frame body --rig FILE to compare it with "
        "a camera\n");
  }
}

// Returns T_cam_frame of the frame of the ground truth and of the camera, or body, of the estimate; nullopt if both
// paths are in one frame.
Result<std::optional<geometry::SE3>> frame_of_truth(const EvalInput& input) {
  const std::string frame = frame_of_estimate(input);
  if (frame == "body" && (input.gt_frame == "body" || is_euroc_truth(input))) return std::optional<geometry::SE3>();
  if (input.gt_frame != "body" && !input.rig) {
    if (!frame.empty() && frame != "cam0") {
      print_message(
          "note: {} contains poses of {}; the ground truth is taken to be of the same frame. --rig FILE compares "
          "it with poses of camera 0\n",
          input.estimate, frame);
    }
    return std::optional<geometry::SE3>();
  }
  if (!input.rig) {
    return Error{.file = "command line",
                 .key = "--gt-frame body",
                 .found = "no --rig",
                 .expected = "--rig FILE with the pose of the camera on the body"};
  }
  const auto rig = rig_formats::read_rig(*input.rig);
  if (!rig) return rig.error();
  if (frame == "body" && !input.camera) return std::optional(rig->body_from_first(0));
  const auto camera = camera_of_trajectory(input.estimate, input.of_estimate, *rig, *input.rig, input.camera);
  if (!camera) return camera.error();
  if (input.gt_frame == "body") note_of_body(*rig, *input.rig);
  return std::optional(input.gt_frame == "body" ? rig->body_from_first(*camera).inverse()
                                                : rig->rig_from_first(*camera).inverse());
}

void move_to_one_frame(const geometry::SE3& T_cam_frame, const EvalInput& input, Trajectory& estimate,
                       Trajectory& truth) {
  const bool metric = input.of_estimate.scale == "metric";
  const double distance_m = evaluation::move_to_one_frame(T_cam_frame, metric, estimate, truth);
  if (distance_m == 0) return;
  print_message(
      "note: the unit of {} is not the metre: the ground truth was moved by {:.3f} m to its camera, by the rig and "
      "the orientations of the ground truth\n",
      input.estimate, distance_m);
}

nlohmann::ordered_json number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

std::string json_text(const TrajectoryEvaluation& e) {
  const nlohmann::ordered_json json = {
      {"ate",
       {{"rmse", number(e.ate.rmse)},
        {"mean", number(e.ate.mean)},
        {"median", number(e.ate.median)},
        {"max", number(e.ate.max)},
        {"count", e.ate.count}}},
      {"rpe",
       {{"delta_s", e.rpe.delta_s},
        {"trans_rmse", number(e.rpe.translation_m.rmse)},
        {"rot_rmse_deg", number(e.rpe.rotation_deg.rmse)},
        {"count", e.rpe.translation_m.count}}},
      {"scale", e.scale ? nlohmann::ordered_json(*e.scale) : nlohmann::ordered_json(nullptr)},
      {"coverage", number(e.coverage)},
      {"coverage_of_part", number(e.coverage_of_part)},
      {"gt_length_m", number(e.gt_length_m)}};
  return json.dump(2) + "\n";
}

// A path of a part of the recording covers little of the ground truth although no frame was lost.
std::string coverage_text(const TrajectoryEvaluation& e) {
  const std::string all = fmt::format("{:.2f} %", 100.0 * e.coverage),
                    part = fmt::format("{:.2f} %", 100.0 * e.coverage_of_part);
  return all == part ? all : fmt::format("{}; from the first to the last pose {}", all, part);
}

std::string table_text(const TrajectoryEvaluation& e, const EvalInput& input) {
  const auto row = [](std::string_view name, const std::string& value) {
    return fmt::format("{:<23} {}\n", name, value);
  };
  const auto errors = [](const evaluation::ErrorStatistics& s, std::string_view unit) {
    if (s.count == 0) return std::string("no pairs of poses with this time difference");
    return fmt::format("rmse {:.6f}  mean {:.6f}  median {:.6f}  max {:.6f}  {}  ({})", s.rmse, s.mean, s.median, s.max,
                       unit, s.count);
  };
  return row("ATE, position", errors(e.ate, "m")) +
         row(fmt::format("RPE over {:g} s, position", e.rpe.delta_s), errors(e.rpe.translation_m, "m")) +
         row(fmt::format("RPE over {:g} s, rotation", e.rpe.delta_s), errors(e.rpe.rotation_deg, "deg")) +
         row("alignment", input.align) +
         row("scale of best fit", e.scale ? fmt::format("{:.6f}", *e.scale) : "not determined") +
         row("coverage", coverage_text(e)) + row("ground truth, length", fmt::format("{:.3f} m", e.gt_length_m));
}

// Tools such as evo_ape take the ground truth first.
void note_of_order(const EvalInput& input) {
  if (input.of_estimate.frame.empty() && !input.of_truth.frame.empty()) {
    print_message("note: {} was estimated by bslam, but is given as the ground truth: the estimate comes first\n",
                  input.ground_truth);
  }
}

Result<TrajectoryEvaluation> evaluate_files(const EvalInput& input) {
  if (const Status status = check_plot(input); !status) return status.error();
  auto read = evaluation::read_trajectory(input.estimate, input.times);
  if (!read) return read.error();
  auto ground_truth = evaluation::read_trajectory(input.ground_truth, input.times);
  if (!ground_truth) return ground_truth.error();
  note_of_order(input);
  note_of_frames(input);
  if (const std::string scale = input.of_estimate.scale; scale != "metric" && input.align != "sim3") {
    print_message("note: the scale of {} is {}, so that its errors are mainly those of the scale; use --align sim3\n",
                  input.estimate, scale);
  }
  const auto T_cam_frame = frame_of_truth(input);
  if (!T_cam_frame) return T_cam_frame.error();
  Trajectory estimate = *std::move(read);
  if (*T_cam_frame) move_to_one_frame(**T_cam_frame, input, estimate, *ground_truth);
  const evaluation::EvaluationOptions options{
      .align = align_mode(input.align), .max_dt_ns = from_seconds(input.max_dt_s), .rpe_delta_s = input.delta_s};
  auto result = evaluation::evaluate(estimate, *ground_truth, options);
  if (!result) {
    Error error = result.error();
    error.file = input.estimate;
    return error;
  }
  if (input.plot) {
    const std::string title = std::filesystem::path(input.estimate).filename().string() + " against " +
                              std::filesystem::path(input.ground_truth).filename().string();
    const std::string svg = report::trajectory_plot_svg(report::evaluation_plot_input(*result, *ground_truth, title));
    if (const Status status = write_atomically(*input.plot, svg); !status) return status.error();
  }
  return result;
}

int run_eval(const EvalArguments& arguments) {
  const EvalInput input = {arguments, evaluation::read_comments(arguments.estimate),
                           evaluation::read_comments(arguments.ground_truth)};
  const auto result = evaluate_files(input);
  if (!result) return report_error(result.error());
  const std::string text = input.json ? json_text(*result) : table_text(*result, input);
  std::fwrite(text.data(), 1, text.size(), stdout);
  return kExitOk;
}

}  // namespace

void add_eval(CLI::App& app, int& exit_status) {
  const auto arguments = std::make_shared<EvalArguments>();
  CLI::App* verb = app.add_subcommand("eval", "trajectory error with respect to ground truth: ATE, RPE, coverage");
  verb->add_option("EST", arguments->estimate, "estimated trajectory: TUM, EuRoC csv or KITTI poses")->required();
  verb->add_option("GT", arguments->ground_truth, "ground truth trajectory, in any of these formats")->required();
  verb->add_option("--align", arguments->align, "alignment of the estimate to ground truth")
      ->check(CLI::IsMember({"se3", "sim3", "none"}))
      ->capture_default_str();
  verb->add_option("--max-dt", arguments->max_dt_s,
                   "maximum time difference in seconds between an estimated pose and its ground truth pose")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  verb->add_option("--gt-frame", arguments->gt_frame, "frame of the ground truth poses; body requires --rig")
      ->check(CLI::IsMember({"cam0", "body"}))
      ->capture_default_str();
  CLI::Option* rig = verb->add_option("--rig", arguments->rig, "calibration with the pose of the camera on the body");
  verb->add_option("--camera", arguments->camera,
                   "camera of the rig whose poses are estimated; default: the one that the trajectory names, or 0")
      ->check(CLI::NonNegativeNumber)
      ->needs(rig);
  verb->add_option("--delta", arguments->delta_s, "time in seconds between the two poses of a relative error (RPE)")
      ->check(CLI::Range(1e-6, 1e6))
      ->capture_default_str();
  verb->add_option("--times", arguments->times,
                   "time stamps of KITTI poses, one per line; default: times.txt in their folder");
  verb->add_flag("--json", arguments->json, "JSON instead of a table");
  verb->add_option("--plot", arguments->plot, "write an SVG with both paths and the error over time to this file");
  verb->callback([arguments, &exit_status] { exit_status = run_eval(*arguments); });
}

}  // namespace bslam::cli
