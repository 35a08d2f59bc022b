// The part of a map that is exported: one submap, because the world frames of submaps are not related to each other.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "base/result.h"
#include "geometry/up_axis.h"
#include "map/bundled_map.h"

namespace bslam::map_export {

struct Selection {
  const map::BundledMap* map = nullptr;
  std::vector<KeyframeId> keyframes;   // in order of time, at least one
  std::vector<LandmarkId> landmarks;   // in order of id: those whose reference keyframe is selected
  std::vector<std::uint8_t> selected;  // per keyframe slot, 1 if it is one of `keyframes`
  geometry::SE3 T_upright_world;       // geometry::upright_axes of the keyframes, or with the given direction

  geometry::SE3 world_from_rig(KeyframeId k) const { return map->keyframe(k).T_rig_world.inverse(); }
};

// Selects submap number `submap` in the order of storage::submaps_of, or, without a number, the one with most
// landmarks. `up`: which direction is upward; without it, it is estimated. Errors: the map has no keyframes; there is
// no such submap; those of up_in_world.
Result<Selection> select_submap(const map::BundledMap& map, std::optional<std::size_t> submap,
                                const std::optional<geometry::UpAxis>& up = {});

// Calls visit(KeyframeId, KeypointRef) for every keypoint that observes the landmark in a selected keyframe.
template <class Visit>
void for_each_keypoint(const Selection& selection, LandmarkId landmark, const Visit& visit) {
  for (const map::Observation& o : selection.map->observations(landmark)) {
    if (!selection.selected[o.keyframe.index()]) continue;
    for (const frame::KeypointRef r : selection.map->keyframe(o.keyframe).frame->bundled.keypoints(o.feature))
      visit(o.keyframe, r);
  }
}

// Median distance from camera 0 of the keyframes to the landmarks they observe, in map units; 0 without landmarks.
double median_depth(const Selection& selection);

}  // namespace bslam::map_export
