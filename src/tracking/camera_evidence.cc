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

void leave_out_inliers_of_new_map(std::size_t keyframes, std::span<const std::uint8_t> overlapping,
                                  std::vector<CameraEvidence>& evidence) {
  if (keyframes > 1) return;
  for (std::size_t c = 0; c < evidence.size(); ++c) {
    if (!overlapping[c]) evidence[c].keypoints = evidence[c].inliers = 0;
  }
}

std::vector<std::uint8_t> overlapping_cameras(const camera::Rig& rig) {
  constexpr double kSome = 0.1;
  std::vector<std::uint8_t> out(rig.size(), 0);
  for (std::size_t c = 0; c < rig.size(); ++c) {
    for (std::size_t other = 0; other < rig.size(); ++other) {
      if (other != c && rig.overlap_share(c, other) >= kSome) out[c] = 1;
    }
  }
  return out;
}

}  // namespace bslam::tracking
