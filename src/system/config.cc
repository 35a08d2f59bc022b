#include "system/config.h"

#include "tracking/tracker.h"

namespace bslam::system {

Config without_calibration(Config config) {
  config.calibration.refine = calibration::Refine::kFalse;
  config.calibration.check = false;
  return config;
}

tracking::TrackerOptions tracker_options(const Config& config, CamerasOfRun cameras) {
  return {.tracking = config.tracking,
          .features = config.features,
          .seed = static_cast<std::uint64_t>(config.seed),
          .localize_only = config.localize_only,
          .correct_rig = config.calibration.refine != calibration::Refine::kFalse,
          .sigma_focal = 0.01 * config.calibration.sigma_focal_percent,
          .first_camera = cameras.first,
          .num_cameras = cameras.size,
          .new_submap_after = config.looping.recovery.new_submap_after,
          .new_submap_after_s = config.looping.recovery.new_submap_after_s};
}

Status check_config(const Config& config, bool with_map) {
  if (config.localize_only && !with_map) {
    return Error{"", "localize_only", "true without a loaded map", "a map to localise in"};
  }
  if (config.calibration.refine == calibration::Refine::kTrue && (config.localize_only || !config.final_adjustment)) {
    return Error{"", "calibration.refine",
                 config.localize_only ? "true with localize_only" : "true without final_adjustment",
                 "the adjustment at the end of the run, which refines them"};
  }
  return {};
}

}  // namespace bslam::system
