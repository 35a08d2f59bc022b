// The landmarks that a keyframe observes.
#pragma once

#include <span>
#include <vector>

#include "map/bundled_map.h"

namespace bslam::map {

// In order of id, each once.
std::vector<LandmarkId> landmarks_of(const BundledMap& map, KeyframeId k);

// Number of landmarks of the keyframe that each camera observes.
std::vector<int> landmarks_by_camera(const BundledKeyframe& keyframe);

// Those of the landmarks that some keyframe observes with the camera, in the same order. All are alive.
std::vector<LandmarkId> observed_by(const BundledMap& map, std::span<const LandmarkId> landmarks, CameraIndex camera);

}  // namespace bslam::map
