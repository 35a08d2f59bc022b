#include "session/report_truth.h"

#include <cmath>
#include <vector>

#include "evaluation/trajectory_error.h"
#include "evaluation/trajectory_file.h"
#include "session/report_arrays.h"

namespace bslam::session {
namespace {

using evaluation::Trajectory;
using nlohmann::ordered_json;

ordered_json number(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(); }

ordered_json statistics_json(const evaluation::ErrorStatistics& s) {
  return {{"rmse", number(s.rmse)}, {"median", number(s.median)}, {"max", number(s.max)}, {"count", s.count}};
}

// T_truth_cam0 of the run's camera 0; nullopt if it is not known. groundtruth_cam0.tum contains poses of the first
// camera of the rig, all other files poses of the body, which is image_0 in the calibration of KITTI.
std::optional<geometry::SE3> camera_in_truth_frame(const dataset::Dataset& dataset) {
  if (dataset.ground_truth->filename() != "groundtruth_cam0.tum") return dataset.rig.body_from_rig();
  const auto used = static_cast<std::size_t>(dataset.cameras_used.front());
  if (used == 0) return geometry::SE3();
  if (!dataset.whole_rig) return std::nullopt;
  return dataset.whole_rig->rig_from_cam(used);
}

// Returns what to know about the comparison, or null. Poses of the body are compared with those of camera 0 as if they
// were the same if the calibration has no body; in KITTI, the body is that of the calibration.
ordered_json note_of_body(const dataset::Dataset& dataset) {
  const bool of_body =
      dataset.ground_truth->filename() != "groundtruth_cam0.tum" && dataset.format != dataset::DatasetFormat::kKitti;
  const camera::Rig& whole = dataset.whole_rig ? *dataset.whole_rig : dataset.rig;
  if (!of_body || !whole.body_from_cam(0).matrix().isIdentity(0)) return nullptr;
  return "The calibration gives camera 0 no pose on the body other than the identity: the body, whose poses are the "
         "ground truth, is taken to be camera 0.";
}

// The true poses of camera 0 from the first frame to the last one that was processed, with a margin of `tolerance_ns`.
Trajectory truth_of_camera(const Trajectory& truth, const dataset::Dataset& dataset, std::optional<TimeNs> last_ns,
                           const geometry::SE3& T_truth_cam0, TimeNs tolerance_ns) {
  Trajectory kept;
  for (const evaluation::TimedPose& pose : truth) {
    const bool outside =
        !dataset.frames.empty() && (pose.time_ns < dataset.frames.front().time_ns - tolerance_ns ||
                                    pose.time_ns > last_ns.value_or(dataset.frames.back().time_ns) + tolerance_ns);
    if (!outside) kept.push_back(pose);
  }
  return moved_to_frame(kept, T_truth_cam0);
}

// The true path in the world of the estimate.
ordered_json true_path(const Trajectory& truth, const geometry::Sim3& T_gt_estimate) {
  const geometry::Sim3 T_estimate_gt = T_gt_estimate.inverse();
  const std::size_t stride = report_stride(truth.size(), kMaxReportPoses);
  std::vector<float> positions;
  for (std::size_t i = 0; i < truth.size(); i += stride) {
    const geometry::Vector3d position = T_estimate_gt * truth[i].T_world_frame.translation();
    for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(position[k]));
  }
  return float_array(positions);
}

}  // namespace

ordered_json report_truth(const dataset::Dataset& dataset, const Trajectory& path, bool metric,
                          std::optional<TimeNs> last_ns) {
  if (!dataset.ground_truth || path.empty()) return nullptr;
  const auto T_truth_cam0 = camera_in_truth_frame(dataset);
  if (!T_truth_cam0) return nullptr;
  const auto given = evaluation::read_trajectory(*dataset.ground_truth);
  if (!given) return {{"error", given.error().message()}};
  const evaluation::EvaluationOptions options{.align =
                                                  metric ? evaluation::AlignMode::kSe3 : evaluation::AlignMode::kSim3};
  const Trajectory truth = truth_of_camera(*given, dataset, last_ns, *T_truth_cam0, options.max_dt_ns);
  const auto found = evaluation::evaluate(path, truth, options);
  if (!found) return {{"error", found.error().found + "; expected " + found.error().expected}};
  std::vector<float> time, error;
  const std::size_t stride = report_stride(found->errors.size(), kMaxReportPoses);
  for (std::size_t i = 0; i < found->errors.size(); i += stride) {
    time.push_back(static_cast<float>(to_seconds(found->errors[i].time_ns - dataset.first_time_ns)));
    error.push_back(static_cast<float>(found->errors[i].position_m));
  }
  return {{"file", dataset.ground_truth->filename().string()},
          {"note", note_of_body(dataset)},
          {"scale_aligned", !metric},
          {"ate_m", statistics_json(found->ate)},
          {"rpe_delta_s", found->rpe.delta_s},
          {"rpe_m", statistics_json(found->rpe.translation_m)},
          {"rpe_deg", statistics_json(found->rpe.rotation_deg)},
          {"scale", found->scale ? ordered_json(*found->scale) : ordered_json()},
          {"coverage", number(found->coverage)},
          {"length_m", number(found->gt_length_m)},
          {"time", float_array(time)},
          {"error_m", float_array(error)},
          {"path", true_path(truth, found->T_gt_estimate)}};
}

}  // namespace bslam::session
