// Decision whether a frame becomes a keyframe. It depends on observations and frame counts only, not on time or load,
// so that results are deterministic.
#pragma once

#include <optional>

#include "map/bundled_map.h"
#include "tracking/frame_matches.h"

namespace bslam::tracking {

// Number of frames after a keyframe after which a camera with few inliers makes the next one due; while tracking is
// direct, the number of frames after which features are extracted because of such a camera.
inline constexpr int kFewInliersInterval = 8;

struct KeyframeEvidence {
  int frames_since_keyframe = 0;
  int overlap = 0;       // landmarks of the reference keyframe among the inliers
  int best_overlap = 0;  // maximum overlap of a frame since the keyframe
  double parallax = 0;   // rad, median angle at these landmarks between the rays to the reference and to this frame
  bool camera_with_few_inliers = false;  // some camera with keypoints has too few inliers
  // Few features with accurate depth are tracked, and many are not yet landmarks: a keyframe would create new metric
  // landmarks.
  bool untracked_depth = false;
};

// Computes all members except the frame counts and the best overlap. `inliers`: matches of `frame` at `T_rig_world`.
KeyframeEvidence keyframe_evidence(const map::BundledMap& map, const frame::BundledFrame& frame,
                                   const FrameMatches& inliers, KeyframeId reference, const geometry::SE3& T_rig_world,
                                   const TrackingOptions& options);

// Per camera: the number of inliers whose landmark the reference keyframe observes.
std::vector<int> overlap_by_camera(const map::BundledMap& map, const FrameMatches& inliers, KeyframeId reference);

bool keyframe_due(const KeyframeEvidence& evidence, const KeyframeOptions& options);

// Returns the keyframe with the smallest parallax among those that are similar to the frame: they observe most of the
// inliers, enough of their landmarks are in view, and the parallax to them is small. If there is one, the rig has
// returned to its position, and the frame need not become a keyframe.
std::optional<KeyframeId> similar_keyframe(const map::BundledMap& map, const frame::BundledFrame& frame,
                                           const FrameMatches& inliers, KeyframeId reference,
                                           const geometry::SE3& T_rig_world, const KeyframeOptions& options);

}  // namespace bslam::tracking
