// Errors of the time stamps of single images, such as those of a driver that stamps images when they arrive.
//
// An image that was captured at another time than its stamp says shows the scene from where the rig was then, which is
// known from its velocity. Relative to the other cameras of its frame it is therefore displaced along the motion of the
// rig, by one unknown: the error of its stamp. An error of the calibration displaces images too, but by what changes
// slowly. The scatter of the errors of successive frames thus shows the variance of those of the stamps, and only where
// it is large are capture times corrected (docs/math.md, section 13).
#pragma once

#include <span>
#include <vector>

#include "tracking/track.h"

namespace bslam::tracking {

// Corrects the capture times of cameras whose stamps are known to be wrong. The errors are estimated together with the
// pose; their prior is normal with the mean and the variance of input.state.stamps. Their mean is left: without a
// common view it would wander with the landmarks of the camera. Other frames stay as they are. `observations`: camera
// by camera. `T_rig_world`: an approximate pose. Returns the former corrections per camera; empty if nothing was
// changed.
std::vector<TimeNs> correct_capture_times(const TrackInput& input,
                                          std::span<const solver::PoseObservation> observations,
                                          const geometry::SE3& T_rig_world, frame::BundledFrame& frame);
void restore_capture_times(std::span<const TimeNs> corrections, frame::BundledFrame& frame);

// Updates the errors with a frame that was tracked at `T_rig_world` and its inliers.
void update_stamp_errors(const map::BundledMap& map, const frame::BundledFrame& frame, const geometry::SE3& T_rig_world,
                         const FrameMatches& inliers, std::vector<StampErrors>& stamps);

}  // namespace bslam::tracking
