#include "session/report_truth.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "evaluation/trajectory_error.h"
#include "evaluation/trajectory_file.h"
#include "session/report_arrays.h"
#include "session/report_map.h"

namespace bslam::session {
namespace {

using evaluation::Trajectory;
using nlohmann::ordered_json;

ordered_json number(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(); }

ordered_json statistics_json(const evaluation::ErrorStatistics& s) {
  return {{"rmse", number(s.rmse)}, {"median", number(s.median)}, {"max", number(s.max)}, {"count", s.count}};
}

// The true path of camera 0 during the estimated path, in the world of the estimate.
ordered_json true_path(const Trajectory& truth_of_cam0, const Trajectory& path, const geometry::Sim3& T_gt_estimate) {
  const auto first = std::ranges::lower_bound(truth_of_cam0, path.front().time_ns, {}, &evaluation::TimedPose::time_ns);
  const auto last = std::ranges::upper_bound(truth_of_cam0, path.back().time_ns, {}, &evaluation::TimedPose::time_ns);
  const geometry::Sim3 T_estimate_gt = T_gt_estimate.inverse();
  const auto stride = static_cast<std::ptrdiff_t>(
      report_stride(static_cast<std::size_t>(std::max<std::ptrdiff_t>(last - first, 0)), kMaxReportPoses));
  std::vector<float> positions;
  for (auto pose = first; pose < last; pose += std::min(stride, last - pose)) {
    const geometry::Vector3d position = T_estimate_gt * pose->T_world_frame.translation();
    for (int i = 0; i < 3; ++i) positions.push_back(static_cast<float>(position[i]));
  }
  return float_array(positions);
}

}  // namespace

ordered_json report_truth(const dataset::Dataset& dataset, const Trajectory& path, bool metric) {
  if (!dataset.ground_truth || path.empty()) return nullptr;
  const auto truth = evaluation::read_trajectory(*dataset.ground_truth);
  if (!truth) return {{"error", truth.error().message()}};
  const geometry::SE3& T_body_cam0 = dataset.rig.body_from_cam(0);
  const evaluation::EvaluationOptions options{.align =
                                                  metric ? evaluation::AlignMode::kSe3 : evaluation::AlignMode::kSim3};
  const auto found = evaluation::evaluate(moved_to_frame(path, T_body_cam0.inverse()), *truth, options);
  if (!found) return {{"error", found.error().found + "; expected " + found.error().expected}};
  std::vector<float> time, error;
  const std::size_t stride = report_stride(found->errors.size(), kMaxReportPoses);
  for (std::size_t i = 0; i < found->errors.size(); i += stride) {
    time.push_back(static_cast<float>(to_seconds(found->errors[i].time_ns - dataset.first_time_ns)));
    error.push_back(static_cast<float>(found->errors[i].position_m));
  }
  return {{"file", dataset.ground_truth->filename().string()},
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
          {"path", true_path(moved_to_frame(*truth, T_body_cam0), path, found->T_gt_estimate)}};
}

}  // namespace bslam::session
