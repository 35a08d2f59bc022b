// Errors of a trajectory, as `bslam eval` computes them. bslam/_evaluation.py is the public function.
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "arguments.h"
#include "arrays.h"
#include "base/atomic_file.h"
#include "bindings.h"
#include "camera/camera_name.h"
#include "errors.h"
#include "evaluation/association.h"
#include "evaluation/trajectory_error.h"
#include "evaluation/trajectory_file.h"
#include "evaluation/trajectory_header.h"
#include "report/plot_file.h"
#include "report/trajectory_plot.h"
#include "rig_formats/rig_file.h"

namespace bslam::python {
namespace {

using Path = std::filesystem::path;
using Rows = nb::ndarray<const double, nb::shape<-1, 8>, nb::c_contig, nb::device::cpu>;
using Given = std::variant<Path, Rows>;

struct Arguments {
  std::string align, gt_frame;
  double max_dt_s = 0, delta_s = 0;
  std::optional<Path> rig, times, plot;
  std::optional<int> camera;
};

evaluation::TimedPose pose_of(const double* row, const std::string& name, std::size_t index) {
  const std::string key = "row " + std::to_string(index);
  for (int k = 0; k < 8; ++k) {
    if (!std::isfinite(row[k])) raise({name, key, "a value that is not a finite number", "t, x, y, z, qx, qy, qz, qw"});
  }
  constexpr double kMax_s = 4e9;  // as in files
  if (std::abs(row[0]) > kMax_s)
    raise({name, key, "the time " + std::to_string(row[0]) + " s", "seconds from -4e9 to 4e9"});
  const Eigen::Quaterniond q(row[7], row[4], row[5], row[6]);
  if (std::abs(q.norm() - 1) > 1e-3) raise({name, key, "a quaternion of norm " + std::to_string(q.norm()), "1"});
  return {from_seconds(row[0]), geometry::SE3(q, {row[1], row[2], row[3]})};
}

evaluation::Trajectory from_rows(const Rows& rows, const std::string& name) {
  evaluation::Trajectory out;
  for (std::size_t i = 0; i < rows.shape(0); ++i) {
    out.push_back(pose_of(rows.data() + 8 * i, name, i));
    if (i > 0 && out[i].time_ns <= out[i - 1].time_ns) {
      raise({name, "row " + std::to_string(i), "a time that is not after the one before", "times that increase"});
    }
  }
  return out;
}

evaluation::Trajectory read(const Given& given, const std::string& name, const std::optional<Path>& times) {
  if (const Path* path = std::get_if<Path>(&given)) return value_of(evaluation::read_trajectory(*path, times));
  return from_rows(std::get<Rows>(given), name);
}

// The camera of the rig whose poses the estimate contains: the argument if given, else the one that the file names.
std::size_t camera_of_estimate(const Arguments& a, const std::string& name, const std::string& frame,
                               const camera::Rig& rig) {
  if (!a.camera) {
    if (const auto named = camera::camera_of_frame(frame, rig)) return *named;
    raise({name, "frame", frame, "a camera of " + a.rig->string() + "; camera=N says which one it is"});
  }
  const auto camera = static_cast<std::size_t>(*a.camera);
  if (*a.camera < 0 || camera >= rig.size()) {
    raise(
        {a.rig->string(), "camera", std::to_string(*a.camera), "a camera number below " + std::to_string(rig.size())});
  }
  return camera;
}

// T_cam_truth of the frame of the ground truth and of the camera of the estimate; nullopt if both paths are in one
// frame, as an estimate of the body and EuRoC's own ground truth are.
std::optional<geometry::SE3> frame_of_truth(const Arguments& a, const std::string& name,
                                            const evaluation::TrajectoryComments& estimate,
                                            const evaluation::TrajectoryComments& truth) {
  const bool body = a.gt_frame == "body", euroc_truth = truth.euroc_csv && truth.frame_of_poses() == "body";
  if (a.camera && !a.rig) raise({"evaluate", "camera", "no rig", "rig=FILE, which has the camera"});
  const std::string frame = a.camera ? estimate.frame : estimate.frame_of_poses();
  if (frame == "body" && (body || euroc_truth)) return std::nullopt;
  if (!a.rig) {
    if (body) raise({"evaluate", "gt_frame=body", "no rig", "rig=FILE with the pose of the camera on the body"});
    return std::nullopt;
  }
  const camera::Rig rig = value_of(rig_formats::read_rig(*a.rig));
  if (frame == "body" && !a.camera) return rig.body_from_first(0);
  const std::size_t camera = camera_of_estimate(a, name, frame, rig);
  return (body ? rig.body_from_first(camera) : rig.rig_from_first(camera)).inverse();
}

evaluation::EvaluationOptions options_of(const Arguments& a) {
  evaluation::EvaluationOptions options;
  if (a.align != "none" && a.align != "se3" && a.align != "sim3")
    raise({"evaluate", "align", a.align, "se3, sim3 or none"});
  if (a.gt_frame != "cam0" && a.gt_frame != "body") raise({"evaluate", "gt_frame", a.gt_frame, "cam0 or body"});
  if (!(a.max_dt_s >= 0 && a.max_dt_s <= 1e6)) raise({"evaluate", "max_dt", std::to_string(a.max_dt_s), "0 to 1e6 s"});
  if (!(a.delta_s >= 1e-6 && a.delta_s <= 1e6))
    raise({"evaluate", "delta", std::to_string(a.delta_s), "1e-6 to 1e6 s"});
  if (a.align == "none") options.align = evaluation::AlignMode::kNone;
  if (a.align == "sim3") options.align = evaluation::AlignMode::kSim3;
  options.max_dt_ns = from_seconds(a.max_dt_s);
  options.rpe_delta_s = a.delta_s;
  return options;
}

nb::dict dict_of(const evaluation::ErrorStatistics& s) {
  nb::dict out;
  out["rmse"] = s.rmse;
  out["mean"] = s.mean;
  out["median"] = s.median;
  out["max"] = s.max;
  out["count"] = s.count;
  return out;
}

Rows8 rows_of(const evaluation::Trajectory& trajectory) {
  std::vector<double> values;
  values.reserve(8 * trajectory.size());
  for (const evaluation::TimedPose& pose : trajectory) {
    const auto& t = pose.T_world_frame.translation();
    const Eigen::Quaterniond& q = pose.T_world_frame.rotation();
    values.insert(values.end(), {to_seconds(pose.time_ns), t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()});
  }
  return make_array<Rows8>(std::move(values), {trajectory.size(), 8});
}

Array<double, -1, 2> rows_of(const std::vector<evaluation::PoseError>& errors) {
  std::vector<double> values;
  for (const evaluation::PoseError& e : errors) values.insert(values.end(), {to_seconds(e.time_ns), e.position_m});
  return make_array<Array<double, -1, 2>>(std::move(values), {errors.size(), 2});
}

nb::dict dict_of(const evaluation::TrajectoryEvaluation& e) {
  nb::dict out;
  out["ate"] = dict_of(e.ate);
  out["rpe_translation"] = dict_of(e.rpe.translation_m);
  out["rpe_rotation_deg"] = dict_of(e.rpe.rotation_deg);
  out["scale"] = e.scale;
  out["coverage"] = e.coverage;
  out["coverage_of_part"] = e.coverage_of_part;
  out["gt_length_m"] = e.gt_length_m;
  out["aligned"] = rows_of(e.aligned_estimate);
  out["errors"] = rows_of(e.errors);
  return out;
}

// The files that are read.
std::vector<Path> files_of(const Given& est, const Given& gt, const Arguments& a) {
  std::vector<Path> files = {a.rig.value_or(""), a.times.value_or("")};
  for (const Given* given : {&est, &gt}) {
    if (const Path* file = std::get_if<Path>(given)) files.push_back(*file);
  }
  return files;
}

evaluation::TrajectoryComments comments_of(const Given& given) {
  const Path* file = std::get_if<Path>(&given);
  return file != nullptr ? evaluation::read_comments(*file) : evaluation::TrajectoryComments{};
}

nb::dict evaluate(const Given& est, const Given& gt, const Arguments& a) {
  const evaluation::EvaluationOptions options = options_of(a);
  if (a.plot) check(report::check_plot_file(*a.plot, "evaluate", "plot", files_of(est, gt, a)));
  auto estimate = read(est, "est", a.times);
  auto truth = read(gt, "gt", a.times);
  const Path* file = std::get_if<Path>(&est);
  const std::string name = file != nullptr ? file->string() : "est";
  const auto comments = comments_of(est);
  if (const auto T_cam_truth = frame_of_truth(a, name, comments, comments_of(gt))) {
    evaluation::move_to_one_frame(*T_cam_truth, comments.scale == "metric", estimate, truth);
  }
  auto result = evaluation::evaluate(estimate, truth, options);
  if (!result) {
    Error error = result.error();
    error.file = name;
    raise(error);
  }
  if (a.plot) {
    const std::string title = (file != nullptr ? file->filename().string() : "estimate") + std::string(" against ") +
                              (gt.index() == 0 ? std::get<Path>(gt).filename().string() : "ground truth");
    check(write_atomically(*a.plot, report::trajectory_plot_svg(report::evaluation_plot_input(*result, truth, title))));
  }
  return dict_of(*result);
}

std::optional<Path> path_argument(nb::handle object, const char* key) {
  return optional_argument<Path>(object, "evaluate", key, "the name of a file");
}

Arguments arguments_of(nb::handle align, nb::handle gt_frame, nb::handle max_dt, nb::handle delta, nb::handle rig,
                       nb::handle times, nb::handle plot, nb::handle camera) {
  return {argument<std::string>(align, "evaluate", "align", "se3, sim3 or none"),
          argument<std::string>(gt_frame, "evaluate", "gt_frame", "cam0 or body"),
          argument<double>(max_dt, "evaluate", "max_dt", "a number of seconds"),
          argument<double>(delta, "evaluate", "delta", "a number of seconds"),
          path_argument(rig, "rig"),
          path_argument(times, "times"),
          path_argument(plot, "plot"),
          optional_argument<int>(camera, "evaluate", "camera", "the number of a camera")};
}

}  // namespace

void bind_evaluation(nb::module_& module) {
  module.def(
      "evaluate",
      [](const Given& est, const Given& gt, nb::handle align, nb::handle max_dt, nb::handle delta, nb::handle gt_frame,
         nb::handle rig, nb::handle camera, nb::handle times, nb::handle plot) {
        return evaluate(est, gt, arguments_of(align, gt_frame, max_dt, delta, rig, times, plot, camera));
      },
      nb::arg("est"), nb::arg("gt"), nb::arg("align").none(), nb::arg("max_dt").none(), nb::arg("delta").none(),
      nb::arg("gt_frame").none(), nb::arg("rig").none(), nb::arg("camera").none(), nb::arg("times").none(),
      nb::arg("plot").none());
}

}  // namespace bslam::python
