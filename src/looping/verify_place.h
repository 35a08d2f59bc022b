// Geometric verification of a place: determines whether a frame was taken near a candidate keyframe of the map, and at
// which pose. Landmarks observed there by any camera are matched to keypoints of any camera of the frame. Used by loop
// closing and relocalisation.
#pragma once

#include <optional>
#include <vector>

#include "base/random.h"
#include "feature/feature_model.h"
#include "looping/options.h"
#include "map/bundled_map.h"

namespace bslam::looping {

struct PlaceMatch {
  KeyframeId matched_keyframe;  // the verified candidate
  geometry::SE3 T_rig_world;    // pose of the frame
  std::vector<std::pair<FeatureId, LandmarkId>>
      matches;             // inliers in order of feature; no feature and no landmark occurs twice
  int inliers = 0;         // number of inlier keypoints
  double found_ratio = 1;  // of the landmarks predicted visible, or of the features of the frame if these are fewer
  double scale = 1;        // scale of the map at the place over the scale at the frame (looping/relative_scale.h)
};

// The reason for which a candidate was rejected.
enum class Rejection { kNone, kFewMatches, kNoConsensus, kFewInliers, kFewFound };

struct VerificationReport {
  Rejection rejection = Rejection::kNone;
  int matches = 0, inliers = 0;
  int expected = 0, found = 0;  // landmarks predicted visible at the estimated pose, and those of them that are matched
};

// Returns nullopt if geometry does not confirm the candidate, which must be alive in `map`. `rig` has the camera poses
// at the capture times of the frame: map.rig_of(keyframe), or frame::rig_of(map.rig(), frame) for other frames. The
// result is deterministic for a given seed.
std::optional<PlaceMatch> verify_place(const map::BundledMap& map, const camera::Rig& rig,
                                       const frame::BundledFrame& frame, KeyframeId candidate,
                                       const VerificationOptions& options, const feature::FeatureModel& features,
                                       Random random, VerificationReport* report = nullptr);

// Returns true if `other` has nearly as many inliers as `best` but a different pose in the same submap, so that the two
// places look alike.
bool contradicts(const map::BundledMap& map, const PlaceMatch& best, const PlaceMatch& other);

// Returns up to `limit` landmarks of a keyframe and its best covisible keyframes, the most often observed ones first.
std::vector<LandmarkId> landmarks_around(const map::BundledMap& map, KeyframeId keyframe, int neighbours, int limit);

}  // namespace bslam::looping
