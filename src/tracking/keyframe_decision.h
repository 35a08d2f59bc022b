// Decision whether a frame becomes a keyframe. It depends on observations and frame counts only, not on time or load,
// so that results are deterministic.
#pragma once

#include <optional>

#include "map/bundled_map.h"
#include "tracking/frame_matches.h"

namespace bslam::tracking {

struct KeyframeEvidence {
  int frames_since_keyframe = 0;
  int overlap = 0;       // landmarks of the reference keyframe among the inliers
  int best_overlap = 0;  // maximum overlap of a frame since the keyframe
  double parallax = 0;   // rad, median angle at these landmarks between the rays to the reference and to this frame
  bool camera_with_few_inliers = false;  // some camera with keypoints has too few inliers
  // Few features with accurate depth are tracked and many are not: a keyframe creates new metric landmarks.
  bool untracked_depth = false;
};

// Everything but the frame counts and the best overlap. `inliers`: matches of `frame` at `T_rig_world`.
KeyframeEvidence keyframe_evidence(const map::BundledMap& map, const frame::BundledFrame& frame,
                                   const FrameMatches& inliers, KeyframeId reference, const geometry::SE3& T_rig_world,
                                   const TrackingOptions& options);

// Per camera: the number of inliers whose landmark the reference keyframe observes.
std::vector<int> overlap_by_camera(const map::BundledMap& map, const FrameMatches& inliers, KeyframeId reference);

bool keyframe_due(const KeyframeEvidence& evidence, const KeyframeOptions& options);

// The keyframe with the smallest parallax among those that show the same as the frame from nearby: it observes most of
// the inliers, enough of its landmarks are in view, and the parallax to it is small. A frame that is due needs no
// keyframe of its own then: the rig is back where it was.
std::optional<KeyframeId> similar_keyframe(const map::BundledMap& map, const frame::BundledFrame& frame,
                                           const FrameMatches& inliers, KeyframeId reference,
                                           const geometry::SE3& T_rig_world, const KeyframeOptions& options);

}  // namespace bslam::tracking
