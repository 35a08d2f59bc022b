#include "calibration/calibration_prior.h"

#include <algorithm>
#include <cmath>

namespace bslam::calibration {
namespace {

constexpr double kMillimetresPerMetre = 1000.0, kMillisecondsPerSecond = 1000.0;

// Returns true if a time changed by more than `suspect_sigmas` standard deviations and `suspect_ms`.
bool significant(double change_s, double sigma_s, const CalibrationOptions& options) {
  return std::abs(change_s) > std::max(options.suspect_sigmas * sigma_s, options.suspect_ms / kMillisecondsPerSecond);
}

}  // namespace

double longest_baseline(const camera::Rig& rig) {
  double longest = 0;
  for (std::size_t c = 1; c < rig.size(); ++c) longest = std::max(longest, rig.cam_from_rig(c).translation().norm());
  return longest;
}

double translation_deviation(const camera::Rig& rig, const CalibrationOptions& options) {
  return std::hypot(options.sigma_translation_mm / kMillimetresPerMetre,
                    0.01 * options.sigma_translation_percent * longest_baseline(rig));
}

camera::Rig with_time_offsets_of(const camera::Rig& of_map, const camera::Rig& rig) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
    cameras.back().camera.time_offset_ns = of_map.camera(c).time_offset_ns;
  }
  return camera::Rig(std::move(cameras));
}

RigAdjustmentOptions prior_without_timing(const camera::Rig& rig, const CalibrationOptions& options) {
  RigAdjustmentOptions out{.sigma_rotation = geometry::radians(options.sigma_rotation_deg),
                           .sigma_translation = translation_deviation(rig, options),
                           .sigma_depth = options.sigma_depth_mm / kMillimetresPerMetre,
                           .sigma_scale = 0.01 * options.sigma_scale_percent,
                           .sigma_aspect = 0.01 * options.sigma_aspect_percent,
                           .correlated_observations = options.correlated_observations};
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const camera::Camera& camera = rig.camera(c);
    out.sigma_intrinsics.push_back(camera::typical_sigmas(camera.model, 0.01 * options.sigma_focal_percent,
                                                          0.01 * options.sigma_centre_percent * camera.width));
  }
  return out;
}

std::vector<solver::TimingPrior> timing_prior(const camera::Rig& of_map, const camera::Rig& calibrated,
                                              const CalibrationOptions& options) {
  std::vector<solver::TimingPrior> out;
  for (std::size_t c = 0; c < calibrated.size(); ++c) {
    const camera::Camera& camera = calibrated.camera(c);
    const double shift_s = to_seconds(camera.time_offset_ns - of_map.camera(c).time_offset_ns);
    out.push_back({{shift_s, camera.readout_s},
                   c == 0 ? 0.0 : options.sigma_time_offset_ms / kMillisecondsPerSecond,
                   options.sigma_readout_ms / kMillisecondsPerSecond});
  }
  return out;
}

std::vector<solver::TimingPrior> contradicted(std::vector<solver::TimingPrior> prior, const camera::Rig& of_map,
                                              const RigAdjustment& estimate, const CalibrationOptions& options) {
  bool any = false;
  for (std::size_t c = 0; c < prior.size(); ++c) {
    const camera::CameraTiming &change = estimate.cameras[c].timing_change, &sigma = estimate.cameras[c].timing_sigma;
    if (!significant(change.shift_s, sigma.shift_s, options)) prior[c].sigma_shift = 0;
    if (!significant(change.readout_s, sigma.readout_s, options)) prior[c].sigma_readout = 0;
    any |= prior[c].sigma_shift > 0 || prior[c].sigma_readout > 0;
    // An earlier estimate was wrong.
    any |= prior[c].mean.shift_s != 0 || prior[c].mean.readout_s != of_map.camera(c).readout_s;
  }
  return any ? prior : std::vector<solver::TimingPrior>{};
}

}  // namespace bslam::calibration
