// Decision whether a frame becomes a keyframe. It depends on observations and frame counts only, not on time or load,
// so that results are deterministic.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "map/bundled_map.h"
#include "tracking/frame_matches.h"

namespace bslam::tracking {

// Number of frames after a keyframe after which a camera with few inliers makes the next one due, half of it if the
// newest keyframe has no image of the camera; while tracking is direct, the number of frames after which features are
// extracted because of such a camera.
inline constexpr int kFewInliersInterval = 8;

// The keyframe with which the frames of a camera are compared: the newest one with an image of the camera. Cameras with
// images in every keyframe have the newest one. A slower camera keeps the last keyframe that has its image: compared
// with a newer one, it would seem unchanged, and would get fewer and fewer landmarks.
struct CameraReference {
  KeyframeId keyframe;
  int frames = 0;  // number of frames of the rig that were tracked since then
  // Maximum number of the keyframe's landmarks found in a frame since then: in frames with features by all cameras with
  // this reference together, each landmark counted once, and by this camera; by this camera in frames that were tracked
  // directly.
  int best_overlap = 0;
  int best_own_overlap = 0;
  int best_direct_overlap = 0;
  bool late = false;  // the camera had no image in some frame since then
};

struct KeyframeEvidence {
  int frames_since_keyframe = 0;
  int overlap = 0;           // landmarks of the reference keyframe among the inliers
  int best_overlap = 0;      // maximum overlap of a frame since the keyframe
  double parallax = 0;       // rad, median angle at these landmarks between the rays to the reference and to this frame
  double near_parallax = 0;  // rad, the angle that a tenth of them exceeds, as near landmarks do
  bool camera_with_few_inliers = false;  // some camera with keypoints has too few inliers
  bool without_newest = false;           // the newest keyframe has no image of the cameras that are compared
  // Few features with accurate depth are tracked, and many are not yet landmarks: a keyframe would create new metric
  // landmarks.
  bool untracked_depth = false;
};

// Computes all members except the frame counts and the best overlap. `inliers`: matches of `frame` at `T_rig_world`.
// `cameras`: nonzero for those that are compared with the reference; empty: all.
KeyframeEvidence keyframe_evidence(const map::BundledMap& map, const frame::BundledFrame& frame,
                                   const FrameMatches& inliers, KeyframeId reference, const geometry::SE3& T_rig_world,
                                   const TrackingOptions& options, std::span<const std::uint8_t> cameras = {});

// The evidence for each reference keyframe of the cameras that have an image, the newest one first. `direct`: the frame
// was tracked directly. The maximum overlap of the references is updated.
std::vector<KeyframeEvidence> evidence_by_reference(const map::BundledMap& map, const frame::BundledFrame& frame,
                                                    const FrameMatches& inliers, const geometry::SE3& T_rig_world,
                                                    const TrackingOptions& options, bool direct,
                                                    std::vector<CameraReference>& references);

// Makes a keyframe the reference of the cameras that have an image in `frame`, and of those without any reference.
void refer_to(KeyframeId keyframe, const frame::BundledFrame& frame, std::vector<CameraReference>& references);

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
