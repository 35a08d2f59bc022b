// Extrinsics of cameras that the images do not show.
#pragma once

#include "calibration/rig_bundle_adjustment.h"
#include "camera/rig.h"

namespace bslam::calibration {

// Corrects the extrinsics of cameras with hardly any observations for the estimated intrinsics of camera 0. Calibrated
// extrinsics are relative to the axes of camera 0 under the given intrinsics. If the estimated intrinsics rotate the
// rays of the pixels by R_given_estimated (the rotation that fits best, turn_of_rays), an unobserved camera has
//     T_cam_rig = T_cam_rig,given R_given_estimated.
// With the given extrinsics it would be inconsistent with the other cameras. Cameras of the estimate that `given` does
// not have, which are those after a move (moved_camera.h), stay as they are.
void complete_unobserved_cameras(const camera::Rig& given, RigAdjustment& adjusted);

}  // namespace bslam::calibration
