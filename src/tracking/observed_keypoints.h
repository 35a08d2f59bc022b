// The keypoints of a frame and which of them are landmarks, for display.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/shared_array.h"
#include "frame/bundled_frame.h"
#include "tracking/frame_matches.h"

namespace bslam::tracking {

// The keypoints of one camera. In a frame that was tracked directly these are the landmarks that were aligned.
struct ObservedKeypoints {
  SharedArray<Eigen::Vector2f> pixel;  // raw, distorted image
  std::vector<Match> matched;          // matches to landmarks, including outliers; empty if the frame has no pose
  std::vector<Match> inliers;          // the matches that support the pose
};

// One entry per camera. Matches that are missing are empty.
std::vector<ObservedKeypoints> observed_keypoints(const frame::BundledFrame& frame, FrameMatches matched = {},
                                                  FrameMatches inliers = {});

}  // namespace bslam::tracking
