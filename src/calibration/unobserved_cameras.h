// Extrinsics of cameras that the images do not show.
#pragma once

#include "calibration/rig_bundle_adjustment.h"
#include "camera/rig.h"

namespace bslam::calibration {

// A camera with fewer inliers is not observed. A few wrong matches could otherwise turn it.
inline constexpr int kMinCameraObservations = 100;

// T_cam_rig of a camera c that is not observed. Calibrated extrinsics are relative to the axes of camera 0 under the
// given intrinsics. If the `estimated` intrinsics of camera 0 rotate the rays of its pixels by R_given_estimated (the
// rotation that fits best, turn_of_rays), then
//     T_cam_rig = T_cam_rig,given R_given_estimated.
// With the given extrinsics it would be inconsistent with the other cameras. The rig frame must be that of camera 0.
geometry::SE3 unobserved_extrinsics(const camera::Rig& given, std::size_t c, const camera::CameraModel& estimated);

// Gives the cameras of the rig that are not observed these extrinsics, and the deviations of the calibration. What the
// images tell about the other cameras does not change. Only RigInformation::change, from which several estimates are
// combined, has the values that the calibration alone predicts. Cameras of the estimate that `given` does not have,
// which are those after a move (moved_camera.h), stay as they are.
void complete_unobserved_cameras(const camera::Rig& given, RigAdjustment& adjusted);

}  // namespace bslam::calibration
