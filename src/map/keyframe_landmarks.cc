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

std::vector<int> landmarks_by_camera(const BundledKeyframe& keyframe) {
  std::vector<int> seen(keyframe.frame->cameras.size(), 0);
  for (std::size_t f = 0; f < keyframe.landmarks.size(); ++f) {
    if (!keyframe.landmarks[f].valid()) continue;
    for (const frame::KeypointRef r : keyframe.frame->bundled.keypoints(FeatureId(f))) ++seen[r.camera.index()];
  }
  return seen;
}

std::vector<LandmarkId> observed_by(const BundledMap& map, std::span<const LandmarkId> landmarks, CameraIndex camera) {
  const auto observes = [&](const Observation& o) {
    return std::ranges::any_of(map.keyframe(o.keyframe).frame->bundled.keypoints(o.feature),
                               [&](const frame::KeypointRef& r) { return r.camera == camera; });
  };
  std::vector<LandmarkId> out;
  for (const LandmarkId l : landmarks) {
    if (std::ranges::any_of(map.observations(l), observes)) out.push_back(l);
  }
  return out;
}

}  // namespace bslam::map
