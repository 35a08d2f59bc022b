// Combines the calibrations that were estimated from several recordings of one rig.
#pragma once

#include <span>
#include <vector>

#include "calibration/rig_refinement.h"

namespace bslam::calibration {

// A parameter of the calibration and its uncertainty.
struct CalibratedValue {
  double change =
      0;  // estimate minus given value; in px for intrinsics (distortion: no unit), radians or metres for extrinsics
  double std = 0;         // standard deviation
  bool observed = false;  // std is less than half of the prior's
};

struct CalibratedCamera {
  std::vector<CalibratedValue> intrinsics;  // in the order of camera/model_parameters.h
  // Rotation about the axes of the camera, then translation along them; those of camera 0 are zero and observed.
  std::array<CalibratedValue, 6> extrinsics;
};

struct JointRefinement {
  camera::Rig rig;
  std::vector<CalibratedCamera> cameras;
  RigInformation information;
};

// Combines estimates from different recordings with priors whose mean is the given calibration: the images are weighted
// by their information, and the widest of the priors counts once, in any order of the recordings. A time offset or
// readout time is the mean, weighted by the inverse variances, of the recordings in which it was refined; if it was in
// none, that of the last recording. `refinements`: at least one; all `done`, of the same rig `calibrated` (but for its
// times) and with intrinsics. Returns nullopt if the information is singular.
std::optional<JointRefinement> combine(const camera::Rig& calibrated, std::span<const RigRefinement> refinements);

}  // namespace bslam::calibration
