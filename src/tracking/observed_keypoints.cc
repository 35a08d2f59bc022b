#include "tracking/observed_keypoints.h"

#include <utility>

namespace bslam::tracking {

std::vector<ObservedKeypoints> observed_keypoints(const frame::BundledFrame& frame, FrameMatches matched,
                                                  FrameMatches inliers) {
  std::vector<ObservedKeypoints> out(frame.cameras.size());
  for (std::size_t c = 0; c < out.size(); ++c) {
    out[c].pixel = frame.cameras[c].keypoints.pixel;
    if (c < matched.size()) out[c].matched = std::move(matched[c]);
    if (c < inliers.size()) out[c].inliers = std::move(inliers[c]);
  }
  return out;
}

}  // namespace bslam::tracking
