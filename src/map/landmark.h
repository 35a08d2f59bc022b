// A landmark of the map and its observations.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "base/id.h"
#include "feature/keypoints.h"
#include "frame/bundled.h"

namespace bslam::map {

// Unique feature `feature` of keyframe `keyframe` observes the landmark; each keypoint of the feature gives one
// residual.
struct Observation {
  KeyframeId keyframe;
  FeatureId feature;
  // Whether the keypoints were aligned to the landmark's reference patch, so that their own sigma applies. Otherwise
  // they were matched by descriptor only, or were aligned to a landmark that was merged into this one.
  bool aligned = true;
  friend auto operator<=>(const Observation&, const Observation&) = default;
};

// The keypoint whose patch and pyramid level are the reference for aligning all other observations of a landmark.
struct LandmarkReference {
  KeyframeId keyframe;
  frame::KeypointRef keypoint;
  friend bool operator==(const LandmarkReference&, const LandmarkReference&) = default;
};

// The data of one landmark except its observations, which are stored in a separate column.
struct Landmark {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // metres, map
  // mean unit vector from the observing cameras to the landmark, map frame
  Eigen::Vector3d view_direction = Eigen::Vector3d::Zero();
  // Metres. Distances at which a camera of the resolution of its reference camera sees it on the coarsest level and on
  // level 0.
  float min_distance = 0, max_distance = 0;
  feature::Descriptor descriptor{};     // the medoid of its observations' descriptors
  std::uint64_t descriptor_source = 0;  // hash of the observations of which `descriptor` is the medoid; 0: unknown
  LandmarkReference reference;
  KeyframeId born;  // newest keyframe when the landmark was created
  // number of frames in which it was predicted visible, and in which it was matched
  std::uint32_t expected = 0, found = 0;
  bool alive = false;
};

}  // namespace bslam::map
