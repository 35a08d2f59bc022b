// Extrinsics of cameras that the images do not show.
#pragma once

#include "calibration/rig_bundle_adjustment.h"
#include "camera/rig.h"

namespace bslam::calibration {

// Lets cameras with hardly any observation follow the intrinsics of camera 0 in the estimate: extrinsics are calibrated
// relative to the axes that camera 0 has with its intrinsics. With intrinsics that turn these axes by
// R_given_estimated, for the centre of the image, an unobserved camera has
//     T_cam_rig = T_cam_rig,given R_given_estimated.
// With the given extrinsics it would contradict the other cameras from then on.
void complete_unobserved_cameras(const camera::Rig& given, RigAdjustment& adjusted);

}  // namespace bslam::calibration
