// Collects the observations about the cameras of a frame from which their status is determined.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "image/image_bundle.h"
#include "tracking/camera_health.h"
#include "tracking/camera_status.h"
#include "tracking/frame_record.h"

namespace bslam::tracking {

// Observations about each camera after a frame was tracked; all arguments have one entry per camera. `postponed`: see
// FramePlan. `created`: feature counts of the keyframe in FrameRecord::created; empty without one.
std::vector<CameraEvidence> camera_evidence(const image::ImageBundle& images, const ImageFaults& faults,
                                            std::span<const std::uint8_t> postponed, const FrameRecord& record,
                                            std::span<const CameraCounts> created);

// Leaves the numbers of inliers of cameras that hardly overlap another one out before the map has a second keyframe:
// landmarks in their view are created from keyframes of a moving rig, and without landmarks none of their keypoints can
// agree. `overlapping`: one flag per camera.
void leave_out_inliers_of_new_map(std::size_t keyframes, std::span<const std::uint8_t> overlapping,
                                  std::vector<CameraEvidence>& evidence);

// The flags of the function above.
std::vector<std::uint8_t> overlapping_cameras(const camera::Rig& rig);

}  // namespace bslam::tracking
