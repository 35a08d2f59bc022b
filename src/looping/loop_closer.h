// Loop closing: a keyframe recognises a place seen before, geometry confirms it, and the map is bent so that both
// agree. The same step joins two parts of the map.
#pragma once

#include <optional>

#include "looping/consistency.h"
#include "looping/locate.h"
#include "map/map_edit.h"

namespace bslam::looping {

struct LoopClosure {
  KeyframeId keyframe, with;
  int inliers = 0;      // keypoints that support the relative pose
  double off_px = 0;    // median error of what the keyframe sees of the place, at its pose before
  double apart = 0;     // distance to the place, of that to what is seen of it
  double moved = 0;     // map units the keyframe's centre moved
  double turned = 0;    // rad
  double scaled = 1;    // other than 1 only where the scale is not observable
  bool joined = false;  // two parts of the map became one
};

// The loop stage: its options, its recogniser and what recognition remembers from one keyframe to the next.
class LoopCloser {
 public:
  LoopCloser(std::unique_ptr<PlaceRecogniser> recogniser, const LoopingOptions& options,
             const feature::FeatureModel& features, std::uint64_t seed);

  // Writes the correction to the draft where `keyframe` (alive) closes a loop; the draft is untouched else. Keyframes
  // come in order: one that does not come after the last is of another map, and nothing is remembered then.
  std::optional<LoopClosure> close(KeyframeId keyframe, map::MapDraft& draft);

 private:
  std::optional<Location> verify(KeyframeId keyframe, const map::BundledMap& map, const Candidate& candidate) const;
  bool undisputed(KeyframeId keyframe, const map::BundledMap& map, const Location& location) const;
  std::optional<Location> find(KeyframeId keyframe, const map::BundledMap& map);

  const std::unique_ptr<PlaceRecogniser> recogniser_;
  const LoopingOptions options_;
  const feature::FeatureModel features_;
  const std::uint64_t seed_;
  RecognitionHistory history_;
  KeyframeId last_;  // asked about
};

}  // namespace bslam::looping
