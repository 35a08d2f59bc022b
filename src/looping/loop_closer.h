// Loop closing: a keyframe recognises a place seen before, geometric verification confirms it, and the map is
// corrected. If the place is in another submap, the two submaps are merged.
#pragma once

#include <optional>

#include "looping/consistency.h"
#include "looping/locate.h"
#include "map/map_edit.h"

namespace bslam::looping {

struct LoopClosure {
  KeyframeId keyframe, with;
  int inliers = 0;  // keypoints that support the relative pose
  // median reprojection error in pixels of the matched landmarks, at the keyframe's pose before the correction
  double off_px = 0;
  double apart = 0;     // distance to the matched keyframe over the median distance to the matched landmarks
  double moved = 0;     // translation of the keyframe's centre by the correction, in map units
  double turned = 0;    // rotation by the correction, rad
  double scaled = 1;    // scale correction; differs from 1 only if the scale is not observable
  bool joined = false;  // two submaps were merged
};

// The loop-closing stage: its options, its place recogniser, and the recognition history between keyframes.
class LoopCloser {
 public:
  LoopCloser(std::unique_ptr<PlaceRecogniser> recogniser, const LoopingOptions& options,
             const map::FeatureModel& features, std::uint64_t seed);

  // If `keyframe` (alive) closes a loop, writes the correction to the draft; otherwise leaves the draft unchanged.
  // Keyframes must come in order: an id that does not increase means a new map, and resets the history.
  std::optional<LoopClosure> close(KeyframeId keyframe, map::MapDraft& draft);

 private:
  std::optional<Location> verify(KeyframeId keyframe, const map::BundledMap& map, const Candidate& candidate) const;
  bool is_unambiguous(KeyframeId keyframe, const map::BundledMap& map, const Location& location) const;
  std::optional<Location> find(KeyframeId keyframe, const map::BundledMap& map);

  const std::unique_ptr<PlaceRecogniser> recogniser_;
  const LoopingOptions options_;
  const map::FeatureModel features_;
  const std::uint64_t seed_;
  RecognitionHistory history_;
  KeyframeId last_;  // the last keyframe passed to close()
};

}  // namespace bslam::looping
