// The standard deviations of a given calibration, as the prior of its estimate.
#pragma once

#include <vector>

#include "calibration/rig_bundle_adjustment.h"
#include "calibration/rig_refinement.h"

namespace bslam::calibration {

// The longest distance of a camera from camera 0, in metres.
double longest_baseline(const camera::Rig& rig);

// Standard deviation of the calibrated translations of a rig, per axis, in metres. It has a part that is proportional
// to the longest baseline.
double translation_deviation(const camera::Rig& rig, const CalibrationOptions& options);

// `rig` with the time offsets that were applied to the images of the map, and the frame of camera 0 as the rig frame.
camera::Rig with_time_offsets_of(const camera::Rig& of_map, const camera::Rig& rig);

// The prior of extrinsics and intrinsics; the timing is constant.
RigAdjustmentOptions prior_without_timing(const camera::Rig& rig, const CalibrationOptions& options);

// Prior of the time offsets, relative to those applied to the images of the map, and of the readout times.
std::vector<solver::TimingPrior> timing_prior(const camera::Rig& of_map, const camera::Rig& calibrated,
                                              const CalibrationOptions& options);

// The prior of the times that the images contradict, according to an estimate of all times; the others are constant and
// have their calibrated values. Empty if all times of the map are to be kept.
std::vector<solver::TimingPrior> contradicted(std::vector<solver::TimingPrior> prior, const camera::Rig& of_map,
                                              const RigAdjustment& estimate, const CalibrationOptions& options);

}  // namespace bslam::calibration
