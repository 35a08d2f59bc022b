#include "storage/submaps.h"

#include <algorithm>
#include <tuple>

namespace bslam::storage {

using map::BundledMap;

std::vector<Submap> submaps_of(const BundledMap& map) {
  std::vector<Submap> submaps;
  std::vector<std::size_t> submap_index(map.keyframe_slots());
  for (const KeyframeId root : map.roots()) {
    Submap submap;
    submap.root = root;
    submap.keyframes = {root};
    for (std::size_t i = 0; i < submap.keyframes.size(); ++i) {
      const std::vector<KeyframeId>& children = map.keyframe(submap.keyframes[i]).children;
      submap.keyframes.insert(submap.keyframes.end(), children.begin(), children.end());
    }
    Eigen::AlignedBox3d box;
    for (const KeyframeId k : submap.keyframes) {
      submap_index[k.index()] = submaps.size();
      box.extend(map.keyframe(k).T_rig_world.inverse().translation());
    }
    submap.extent = box.sizes();
    std::ranges::sort(submap.keyframes, {},
                      [&](KeyframeId k) { return std::tuple(map.keyframe(k).frame->time_ns, k); });
    submaps.push_back(std::move(submap));
  }
  for (const LandmarkId l : map.landmark_ids())
    ++submaps[submap_index[map.landmark(l).reference.keyframe.index()]].landmarks;
  return submaps;
}

TimeNs first_time(const BundledMap& map, const Submap& submap) {
  return map.keyframe(submap.keyframes.front()).frame->time_ns;
}
TimeNs last_time(const BundledMap& map, const Submap& submap) {
  return map.keyframe(submap.keyframes.back()).frame->time_ns;
}

evaluation::Trajectory keyframe_trajectory(const BundledMap& map, const Submap& submap) {
  evaluation::Trajectory trajectory;
  for (const KeyframeId k : submap.keyframes) {
    const TimeNs time_ns = map.keyframe(k).frame->time_ns;
    if (!trajectory.empty() && trajectory.back().time_ns == time_ns) continue;
    trajectory.push_back({time_ns, map.keyframe(k).T_rig_world.inverse()});
  }
  return trajectory;
}

}  // namespace bslam::storage
