#include "map/scene_depth.h"

#include <utility>
#include <vector>

#include "base/median.h"

namespace bslam::map {

double median_depth(const BundledMap& map, KeyframeId k) {
  const BundledKeyframe& keyframe = map.keyframe(k);
  std::vector<double> depths;
  for (const LandmarkId l : keyframe.landmarks) {
    if (l.valid()) depths.push_back((keyframe.T_rig_world * map.landmark(l).position).norm());
  }
  return depths.empty() ? 0.0 : median(std::move(depths));
}

}  // namespace bslam::map
