// Where in the map is a lost rig? Place recognition lies above tracking; this is how a tracker is given it.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "map/bundled_map.h"

namespace bslam::tracking {

struct FoundPlace {
  KeyframeId matched_keyframe;                            // alive
  geometry::SE3 T_rig_world;                              // of the frame
  std::vector<std::pair<FeatureId, LandmarkId>> matches;  // inliers
  int inliers = 0;                                        // keypoints
};

class Relocaliser {
 public:
  virtual ~Relocaliser() = default;

  // Prepares a frame to be located or to become a keyframe. Does nothing to a frame that is prepared already.
  virtual void describe(frame::BundledFrame& frame) const = 0;

  // The pose of a described frame, searched for in the whole map. Empty where no place is confirmed.
  virtual std::optional<FoundPlace> verify_place(const map::BundledMap& map, const frame::BundledFrame& frame) = 0;
};

}  // namespace bslam::tracking
