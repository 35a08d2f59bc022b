// Interface through which tracking uses place recognition, which belongs to a higher layer, to relocalise a lost rig.
#pragma once

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "map/bundled_map.h"

namespace bslam::tracking {

struct FoundPlace {
  KeyframeId matched_keyframe;                            // alive in the map
  geometry::SE3 T_rig_world;                              // pose of the frame
  std::vector<std::pair<FeatureId, LandmarkId>> matches;  // inliers
  int inliers = 0;                                        // number of inlier keypoints
  // Of the landmarks predicted visible, or of the features of the frame if these are fewer.
  double found_ratio = 1;
};

class Relocaliser {
 public:
  virtual ~Relocaliser() = default;

  // Prepares a frame for relocalisation or for becoming a keyframe. Does nothing if the frame is already prepared.
  virtual void describe(frame::BundledFrame& frame) const = 0;

  // Searches the whole map for the pose of a described frame. Returns nullopt if no plausible place is confirmed.
  virtual std::optional<FoundPlace> verify_place(const map::BundledMap& map, const frame::BundledFrame& frame,
                                                 const std::function<bool(const FoundPlace&)>& plausible) = 0;

  // Memory of its index of places, in bytes.
  virtual std::size_t memory_bytes() const { return 0; }
};

}  // namespace bslam::tracking
