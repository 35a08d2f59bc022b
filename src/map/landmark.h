// A landmark of the map and the features that observe it.
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "base/id.h"
#include "feature/keypoints.h"
#include "frame/bundled.h"

namespace bslam::map {

// Unique feature `feature` of keyframe `keyframe` shows the landmark; each keypoint of the feature gives one residual.
struct Observation {
  KeyframeId keyframe;
  FeatureId feature;
  bool aligned = true;  // its keypoints were placed by the landmark's reference patch, so that their own sigma holds; else
                        // they were found by descriptor alone, or belonged to a landmark merged into this one
  friend auto operator<=>(const Observation&, const Observation&) = default;
};

// The keypoint whose patch and level all other observations of a landmark are aligned to.
struct LandmarkReference {
  KeyframeId keyframe;
  frame::KeypointRef keypoint;
  friend bool operator==(const LandmarkReference&, const LandmarkReference&) = default;
};

// What is known of one landmark, but for its observations, which are a column of their own.
struct Landmark {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();        // metres, map
  Eigen::Vector3d view_direction = Eigen::Vector3d::Zero();  // mean unit vector from the cameras that see it to it, map
  float min_distance = 0, max_distance = 0;  // metres: where its reference level's neighbours in scale can be found
  feature::Descriptor descriptor{};          // medoid of its observations
  LandmarkReference reference;
  KeyframeId born;                     // newest keyframe when it was made
  std::uint32_t expected = 0, found = 0;  // frames in which it should have been seen, and was
  bool alive = false;
};

}  // namespace bslam::map
