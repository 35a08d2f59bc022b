// A rig pose stored relative to a keyframe, so that it follows later corrections of the map (loop closures, global
// adjustments, changes of scale, merged submaps).
#pragma once

#include <optional>

#include "map/bundled_map.h"

namespace bslam::map {

struct AnchoredPose {
  KeyframeId reference;           // invalid: no pose
  geometry::SE3 T_rig_reference;  // from the reference keyframe's rig frame at its time; lengths in map units
  double scale = 1.0;             // BundledKeyframe::scale of the reference when T_rig_reference was taken

  // Anchors a pose in `map` to `reference`, which must be alive in it.
  static AnchoredPose at(const BundledMap& map, KeyframeId reference, const geometry::SE3& T_rig_world);

  // Returns true if there is a pose and `map` still contains the submap of its reference.
  bool known_in(const BundledMap& map) const { return map.nearest_alive_ancestor(reference).valid(); }

  // T_rig_world in `map`, at its current scale. Returns nullopt if the pose is not known in it.
  std::optional<geometry::SE3> resolve(const BundledMap& map) const;

  // Scale of the reference's submap in `map` relative to the scale of T_rig_reference; 1 without a pose.
  double scale_change(const BundledMap& map) const;
  // Expresses T_rig_reference at the current scale of `map`.
  void rescale(const BundledMap& map);
};

}  // namespace bslam::map
