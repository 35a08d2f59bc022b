#include "tracking/calibration_error.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/median.h"

namespace bslam::tracking {
namespace {

constexpr std::size_t kMinMatches = 30;  // minimum number of matches of a camera
constexpr double kRate = 0.2;            // weight of a new frame

}  // namespace

double update_calibration_error(double before, std::vector<double> squared_errors, std::vector<double> variances,
                                const matching::AlignmentOptions& options) {
  if (squared_errors.size() < kMinMatches) return before;
  const double measured = median(std::move(squared_errors)) / (2 * std::numbers::ln2) - median(std::move(variances));
  const double lower = std::min(options.min_calibration_error_px, options.calibration_error_px);
  const double upper = std::max(options.max_calibration_error_px, options.calibration_error_px);
  const double variance = std::clamp(measured, lower * lower, upper * upper);
  return std::sqrt((1 - kRate) * before * before + kRate * variance);
}

std::vector<double> calibration_errors(std::span<const double> before, const map::BundledMap& map,
                                       const frame::BundledFrame& frame, const TrackOutput& output,
                                       const matching::AlignmentOptions& options) {
  if (output.result.status != TrackStatus::kTracking) {
    std::vector<double> kept(before.begin(), before.end());
    for (double& error : kept) error = std::max(error, options.calibration_error_px);
    return kept;
  }
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  std::vector<double> errors(before.begin(), before.end());
  errors.resize(rig.size(), options.calibration_error_px);
  for (std::size_t c = 0; c < output.matches.size(); ++c) {
    const geometry::SE3 T_cam_world = rig.cam_from_rig(c) * output.result.T_rig_world;
    const feature::Keypoints& keypoints = frame.cameras[c].keypoints;
    std::vector<double> squared_errors, variances;
    for (const Match& m : output.matches[c]) {
      const std::size_t k = m.keypoint.index();
      const Eigen::Vector3d point_cam = rig.shutter(c).at_row(T_cam_world * map.landmark(m.landmark).position,
                                                              static_cast<double>(keypoints.pixel[k].y()));
      const auto projected = rig.camera(c).project(point_cam);
      if (!projected) continue;
      squared_errors.push_back((keypoints.pixel[k].cast<double>() - *projected).squaredNorm());
      const double variance = static_cast<double>(keypoints.sigma[k]) * keypoints.sigma[k];
      variances.push_back(m.aligned ? variance - errors[c] * errors[c] : variance);
    }
    errors[c] = update_calibration_error(errors[c], std::move(squared_errors), std::move(variances), options);
  }
  return errors;
}

std::vector<matching::AlignmentOptions> alignment_by_camera(const matching::AlignmentOptions& options,
                                                            std::span<const double> errors, std::size_t cameras) {
  std::vector<matching::AlignmentOptions> out(cameras, options);
  for (std::size_t c = 0; c < std::min(cameras, errors.size()); ++c) out[c].calibration_error_px = errors[c];
  return out;
}

}  // namespace bslam::tracking
