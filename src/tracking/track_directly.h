// Direct tracking: the pose of a frame from landmarks aligned directly in its images, without extracted features
// (Forster, Pizzoli & Scaramuzza, ICRA 2014, with the patches of this system). It is used between keyframes.
#pragma once

#include <optional>

#include "tracking/track.h"

namespace bslam::tracking {

// The reason why a frame needs extracted features.
enum class DirectFailure {
  kNone,
  kNotTried,
  kNoPrediction,  // the motion of the rig is not known
  kNoPose,        // too few landmarks could be aligned
  kFewInliers,    // some camera has lost a considerable part of its inliers since the last extraction
  kKeyframeDue,
  kDoubtful,  // the map is new, and many of its landmarks do not agree with the pose
};

struct DirectOutput {
  DirectFailure failure = DirectFailure::kNotTried;
  // Set if a pose was found, even if there are few inliers or a keyframe is due.
  std::optional<TrackOutput> output = {};
  bool all_cameras = false;  // every camera supports the pose
};

// Estimates the pose of `frame`, whose cameras have no keypoints. The map must have at least one keyframe. The
// keypoints of the frame in the output are the aligned landmarks; keypoints of one landmark in several cameras are one
// feature.
DirectOutput track_directly(const TrackInput& input, frame::BundledFrame frame, const TrackingOptions& options,
                            ThreadPool& pool);

}  // namespace bslam::tracking
