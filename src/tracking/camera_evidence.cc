#include "tracking/camera_evidence.h"

namespace bslam::tracking {

std::vector<CameraEvidence> camera_evidence(const image::ImageBundle& images, const ImageFaults& faults,
                                            std::span<const std::uint8_t> postponed, const FrameRecord& record,
                                            std::span<const CameraCounts> created) {
  std::vector<CameraEvidence> out;
  for (std::size_t c = 0; c < images.images.size(); ++c) {
    // If a keyframe was created from an earlier frame in which the camera had an image, its features are better
    // evidence than the landmarks that direct tracking searched for.
    const bool of_keyframe = c < created.size() && created[c].keypoints > 0;
    const CameraCounts& counts = of_keyframe ? created[c] : record.result.cameras[c];
    out.push_back({.image = images.images[c].state,
                   .outage = faults.outage[c],
                   .blurred = faults.blurred[c] != 0,
                   .inconsistent = record.result.cameras[c].excluded,
                   .postponed = postponed[c] != 0,
                   .extracted = of_keyframe || !record.direct ? std::optional(counts.keypoints) : std::nullopt,
                   .keypoints = counts.keypoints,
                   .inliers = counts.inliers});
  }
  return out;
}

void leave_out_inliers_of_new_map(std::size_t keyframes, std::vector<CameraEvidence>& evidence) {
  constexpr std::size_t kFew = 4;
  if (keyframes >= kFew) return;
  for (CameraEvidence& camera : evidence) camera.keypoints = camera.inliers = 0;
}

}  // namespace bslam::tracking
