// Makes a keyframe of a tracked frame. Keypoints that tracking matched to one landmark become one feature of the
// Bundled table, and matched features with an accurate metric point become landmarks immediately.
#pragma once

#include <memory>
#include <optional>

#include "map/map_edit.h"
#include "tracking/frame_matches.h"

namespace bslam::tracking {

// Returns true if the relative standard deviation of the distance of `point` is at most options.max_depth_error, so
// that the matched feature becomes a landmark immediately.
bool has_accurate_depth(const std::optional<frame::BundledPoint>& point, const InitialisationOptions& options);

struct NewKeyframe {
  KeyframeId keyframe;                // provisional, as in the draft
  std::vector<LandmarkId> landmarks;  // observed by it, including new ones (provisional), in order of id
};

// Writes the keyframe of `frame` at `T_rig_world` and its new landmarks into `draft`. `matches`: inliers, whose
// landmarks must be alive. `reference` is its parent in the spanning tree if it shares no landmark with any keyframe.
NewKeyframe make_keyframe(const frame::BundledFrame& frame, const FrameMatches& matches,
                          const geometry::SE3& T_rig_world, std::span<const image::Pyramid> pyramids,
                          KeyframeId reference, const InitialisationOptions& options, map::MapDraft& draft);

}  // namespace bslam::tracking
