// The estimate of a calibration from a map: which observations are used, and in how many adjustments.
#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include "calibration/moved_camera.h"
#include "calibration/rig_problem.h"
#include "calibration/time_jump.h"

namespace bslam::calibration {

struct EstimateInput {
  const map::BundledMap& map;
  const camera::Rig& calibrated;  // the given calibration
  const CalibrationOptions& options;
  const feature::FeatureModel& features;
  const std::stop_token& stop;
  KeyframeId first{0};  // the first one of this run; those before it are of a map that was loaded
};

struct RigEstimate {
  MovedCameras cameras;
  // The given calibration of these cameras, with the time offsets that were applied to the images of the map.
  std::shared_ptr<const camera::Rig> reference;
  RigProblem problem;  // poses and points belong to the estimate
  RigAdjustment adjusted = {};
  // False if the extrinsics still changed by more than their uncertainty when rejected observations had been searched
  // for several times: the calibration is far off, or the images do not belong to it.
  bool settled = false;
  // The time stamps of a camera seem to have changed during the run; no moves are then part of the estimate.
  std::optional<TimeJump> jump = {};
  // The images of a camera contradict each other (unsteady_camera); moves are then not searched.
  std::optional<std::size_t> unsteady = {};
  double path_before = 0;  // path_length() with the rig of the map
};

// The options for an estimate from a fraction of the map, which is enough for a verdict.
CalibrationOptions quick(CalibrationOptions options);
// Options of an adjustment from which only the verdict is used: coarser convergence, no effects on the poses.
RigAdjustmentOptions for_verdict(RigAdjustmentOptions options);

// The prior of all parameters that are estimated from the map. Times are constant unless the images contradict them.
RigAdjustmentOptions prior_with_timing(const EstimateInput& input, const MovedCameras& cameras);

// Estimates the calibration with the moves of cameras that are known.
RigEstimate estimate_rig(const EstimateInput& input, const RigAdjustmentOptions& prior, MovedCameras cameras);

}  // namespace bslam::calibration
