#include "map/keyframe_landmarks.h"

#include <algorithm>

namespace bslam::map {

std::vector<LandmarkId> landmarks_of(const BundledMap& map, KeyframeId k) {
  std::vector<LandmarkId> out;
  for (const LandmarkId l : map.keyframe(k).landmarks) {
    if (l.valid()) out.push_back(l);
  }
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace bslam::map
