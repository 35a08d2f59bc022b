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
  std::vector<double> errors(before.begin(), before.end());
  errors.resize(map.rig().size(), options.calibration_error_px);
  const auto of_matches = squared_errors(map, frame, output.result.T_rig_world, output.matches);
  for (std::size_t c = 0; c < output.matches.size(); ++c) {
    const feature::Keypoints& keypoints = frame.cameras[c].keypoints;
    std::vector<double> known_errors, variances;
    for (std::size_t i = 0; i < output.matches[c].size(); ++i) {
      if (!of_matches[c][i]) continue;
      const Match& m = output.matches[c][i];
      const double sigma = static_cast<double>(keypoints.sigma[m.keypoint.index()]);
      known_errors.push_back(*of_matches[c][i]);
      variances.push_back(m.aligned ? sigma * sigma - errors[c] * errors[c] : sigma * sigma);
    }
    errors[c] = update_calibration_error(errors[c], std::move(known_errors), std::move(variances), options);
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
