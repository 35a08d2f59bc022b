// When a frame becomes a keyframe. Looks at what was seen and at frame counts, never at a clock or at who is busy.
#pragma once

#include "map/bundled_map.h"
#include "tracking/frame_matches.h"

namespace bslam::tracking {

struct KeyframeEvidence {
  int frames_since_keyframe = 0;
  int overlap = 0;           // landmarks of the reference keyframe among the inliers
  int best_overlap = 0;      // the most of them in a frame since the keyframe
  double parallax = 0;       // radians, median over them, at the landmark between then and now
  bool starved = false;      // some camera with keypoints has too few inliers
  bool fresh_depth = false;  // few features with landmarks, many matched ones without: new metric points to be had
};

KeyframeEvidence keyframe_evidence(const map::BundledMap& map, const frame::BundledFrame& frame,
                                   const FrameMatches& inliers, KeyframeId reference, const geometry::SE3& T_rig_world,
                                   const TrackingOptions& options);

bool keyframe_due(const KeyframeEvidence& evidence, const KeyframeOptions& options);

}  // namespace bslam::tracking
