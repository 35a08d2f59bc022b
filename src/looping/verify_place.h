// Geometric verification of a place: was the frame taken near a candidate keyframe of the map, and at which pose?
// Landmarks that any camera saw from there are matched to keypoints of any camera of the frame. Loop closing and
// relocalisation both use it.
#pragma once

#include <optional>
#include <vector>

#include "base/random.h"
#include "feature/feature_model.h"
#include "looping/options.h"
#include "map/bundled_map.h"

namespace bslam::looping {

struct PlaceMatch {
  KeyframeId matched_keyframe;  // the candidate
  geometry::SE3 T_rig_world;    // of the frame
  std::vector<std::pair<FeatureId, LandmarkId>>
      matches;       // inliers, in order of feature; features and landmarks distinct
  int inliers = 0;   // keypoints
  double scale = 1;  // of the place relative to the map about the frame (looping/relative_scale.h)
};

// Why a candidate was rejected.
enum class Rejection { kNone, kFewMatches, kNoConsensus, kFewInliers, kFewFound };

struct VerificationReport {
  Rejection rejection = Rejection::kNone;
  int matches = 0, inliers = 0;
  int sought = 0, found = 0;  // landmarks expected in view at the pose found, and matched
};

// Empty where geometry does not confirm the candidate (alive in `map`). `rig`: as it stood while the frame was taken,
// which for a frame that is no keyframe is frame::rig_of(map.rig(), frame). Deterministic for a seed.
std::optional<PlaceMatch> verify_place(const map::BundledMap& map, const camera::Rig& rig,
                                       const frame::BundledFrame& frame, KeyframeId candidate,
                                       const VerificationOptions& options, const feature::FeatureModel& features,
                                       Random random, VerificationReport* report = nullptr);

// Is `other` as good an answer as `best`, and cannot both be true? In one part of the map they are then two places that
// look alike.
bool contradicts(const map::BundledMap& map, const PlaceMatch& best, const PlaceMatch& other);

// The landmarks of a keyframe and its best covisible keyframes, those seen most often first, at most `limit`.
std::vector<LandmarkId> landmarks_around(const map::BundledMap& map, KeyframeId keyframe, int neighbours, int limit);

}  // namespace bslam::looping
