// From a tracked frame to a keyframe: what tracking learnt about which keypoints belong together goes into the Bundled
// table, and matched features with a sound metric point become landmarks at once.
#pragma once

#include <memory>
#include <optional>

#include "map/map_edit.h"
#include "tracking/frame_matches.h"

namespace bslam::tracking {

// May a matched feature with this point become a landmark at once? The standard deviation of its distance decides.
bool has_sound_depth(const std::optional<frame::BundledPoint>& point, const InitialisationOptions& options);

struct NewKeyframe {
  KeyframeId keyframe;                // provisional, as in the draft
  std::vector<LandmarkId> landmarks;  // observed by it, also new ones (provisional), in order of id
};

// Writes the keyframe of `frame` at `T_rig_world` and its new landmarks into `draft`. `matches`: inliers, landmarks
// alive. `reference` is its parent in the spanning tree where it shares nothing with any keyframe.
NewKeyframe make_keyframe(const frame::BundledFrame& frame, const FrameMatches& matches,
                          const geometry::SE3& T_rig_world, std::span<const image::Pyramid> pyramids,
                          KeyframeId reference, const InitialisationOptions& options, map::MapDraft& draft);

}  // namespace bslam::tracking
