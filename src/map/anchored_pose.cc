#include "map/anchored_pose.h"

namespace bslam::map {

using geometry::SE3;

AnchoredPose AnchoredPose::at(const BundledMap& map, KeyframeId reference, const SE3& T_rig_world) {
  return {reference, T_rig_world * map.resolved_pose(reference).inverse(), map.keyframe(reference).scale};
}

std::optional<SE3> AnchoredPose::resolve(const BundledMap& map) const {
  if (!known_in(map)) return std::nullopt;
  return geometry::scaled(T_rig_reference, scale_change(map)) * map.resolved_pose(reference);
}

double AnchoredPose::scale_change(const BundledMap& map) const {
  return reference.valid() ? map.keyframe(reference).scale / scale : 1.0;
}

void AnchoredPose::rescale(const BundledMap& map) {
  const double change = scale_change(map);
  if (change == 1.0) return;
  T_rig_reference = geometry::scaled(T_rig_reference, change);
  scale = map.keyframe(reference).scale;
}

}  // namespace bslam::map
