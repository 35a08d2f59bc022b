#include "map_export/selection.h"

#include <algorithm>
#include <string>

#include "base/median.h"
#include "geometry/vertical_direction.h"
#include "map/scene_depth.h"
#include "storage/submaps.h"

namespace bslam::map_export {

Result<Selection> select_submap(const map::BundledMap& map, std::optional<std::size_t> submap,
                                const std::optional<geometry::UpAxis>& up) {
  const std::vector<storage::Submap> submaps = storage::submaps_of(map);
  if (submaps.empty()) return Error{"", "", "a map without keyframes", "a map with keyframes"};
  if (submap && *submap >= submaps.size())
    return Error{"command line", "--submap", std::to_string(*submap),
                 "a number below " + std::to_string(submaps.size())};
  const auto largest = std::ranges::max_element(submaps, {}, &storage::Submap::landmarks);
  const storage::Submap& chosen = submap ? submaps[*submap] : *largest;
  Selection selection{&map, chosen.keyframes, {}, std::vector<std::uint8_t>(map.keyframe_slots(), 0), {}};
  std::vector<geometry::SE3> poses;
  for (const KeyframeId k : chosen.keyframes) {
    selection.selected[k.index()] = 1;
    poses.push_back(selection.world_from_rig(k));
  }
  selection.T_upright_world = geometry::upright_axes(poses);
  if (up) {
    const auto up_world = geometry::up_in_world(*up, poses, map.rig().body_from_rig());
    if (!up_world) return up_world.error();
    selection.T_upright_world = geometry::upright_axes(poses, *up_world);
  }
  for (const LandmarkId l : map.landmark_ids()) {
    if (selection.selected[map.landmark(l).reference.keyframe.index()]) selection.landmarks.push_back(l);
  }
  return selection;
}

double median_depth(const Selection& selection) {
  std::vector<double> depths;
  for (const KeyframeId k : selection.keyframes) {
    if (const double depth = map::median_depth(*selection.map, k); depth > 0) depths.push_back(depth);
  }
  return depths.empty() ? 0.0 : median(std::move(depths));
}

}  // namespace bslam::map_export
