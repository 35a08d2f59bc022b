// Loop closing: a keyframe recognises a place seen before, geometric verification confirms it, and the map is
// corrected. If the place is in another submap, the two submaps are merged.
#pragma once

#include <optional>

#include "looping/consistency.h"
#include "looping/joined_return.h"
#include "looping/verify_place.h"
#include "map/map_edit.h"

namespace bslam::looping {

struct LoopClosure {
  KeyframeId keyframe, matched_keyframe;
  int inliers = 0;  // keypoints that support the relative pose
  // median reprojection error in pixels of the matched landmarks, at the keyframe's pose before the correction
  double reprojection_error_px = 0;
  double relative_distance = 0;  // distance to the matched keyframe over the median distance to the matched landmarks
  double translation_correction = 0;  // translation of the keyframe's centre by the correction, in map units
  double rotation_correction = 0;     // rotation by the correction, rad
  double scale_correction = 1;        // scale correction; differs from 1 only if the scale is not observable
  bool merged = false;                // two submaps were merged
};

// The stages of recognising a keyframe in another submap, in their order.
enum class JoinStage { kNoCandidate, kNotConsistent, kNotVerified, kAmbiguous };

struct JoinAttempts {
  JoinStage farthest = JoinStage::kNoCandidate;  // the last stage reached by any keyframe that was not joined
  int most_inliers = 0;                          // largest number of inliers of a candidate that was not verified
};

// The loop-closing stage: its options, its place recogniser, and the recognition history between keyframes.
class LoopCloser {
 public:
  LoopCloser(std::unique_ptr<PlaceRecogniser> recogniser, const LoopingOptions& options,
             const feature::FeatureModel& features, std::uint64_t seed);

  // If `keyframe` (alive) closes a loop, writes the correction to the draft; otherwise leaves the draft unchanged.
  // Keyframes must come in order of their ids. `attempts` is updated with the results for candidates in other submaps.
  // A draft with a closure must be committed before the next call; if its commit is rejected, the next keyframes can
  // still close the loop.
  std::optional<LoopClosure> close(KeyframeId keyframe, map::MapDraft& draft, JoinAttempts* attempts = nullptr);

  // Declares that the draft of a closure was committed.
  void committed(const LoopClosure& closure);

  // Declares that the next keyframe does not continue the path of the previous ones.
  void begin_path() {
    history_ = {};
    joined_ = {};
  }

  // Memory of the index of its place recogniser, in bytes.
  std::size_t memory_bytes() const { return recogniser_->memory_bytes(); }

 private:
  std::optional<PlaceMatch> verify(KeyframeId keyframe, const map::BundledMap& map, const PlaceCandidate& candidate,
                                   JoinAttempts& attempts) const;
  bool is_unambiguous(KeyframeId keyframe, const map::BundledMap& map, const PlaceMatch& place_match) const;
  using Found = std::optional<std::pair<PlaceMatch, LoopClosure>>;
  Found find(KeyframeId keyframe, const map::BundledMap& map, JoinAttempts& attempts);
  Found closure_at(KeyframeId keyframe, const map::BundledMap& map, PlaceMatch place_match,
                   JoinAttempts& attempts) const;

  const std::unique_ptr<PlaceRecogniser> recogniser_;
  const LoopingOptions options_;
  const feature::FeatureModel features_;
  const std::uint64_t seed_;
  RecognitionHistory history_;
  JoinedReturns joined_;
};

}  // namespace bslam::looping
