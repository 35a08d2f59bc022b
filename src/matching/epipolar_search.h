// Matching keypoints of two posed cameras along epipolar planes, without rectification and for any camera model.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/id.h"
#include "camera/camera.h"
#include "camera/rolling_shutter.h"
#include "feature/feature_model.h"
#include "feature/keypoints.h"
#include "geometry/se3.h"

namespace bslam::matching {

// A camera with its keypoints and its pose in a frame common to both views.
struct EpipolarView {
  const camera::Camera* camera = nullptr;
  const feature::Keypoints* keypoints = nullptr;
  geometry::SE3 T_common_cam;                 // at the exposure of the middle row
  std::span<const std::uint8_t> usable = {};  // per keypoint, 0: ignored; empty: all are used
  // Determines the standard deviations of the keypoints if the views belong to different frames. Null: the keypoints'
  // own standard deviations, which are valid between cameras of one frame.
  const feature::FeatureModel* features = nullptr;
  camera::Shutter shutter = {};
};

struct EpipolarOptions {
  double min_depth_m = 0.2;      // minimum distance of a point from the first camera, metres
  double max_depth_m = 1e9;      // maximum distance, metres
  double sigmas = 3.0;           // maximum distance from the epipolar plane, in standard deviations of both keypoints
  int max_hamming = 60;          // maximum descriptor distance, of 256 bits
  double ratio = 0.85;           // maximum ratio of best to second best descriptor distance elsewhere on the curve
  int max_level_difference = 2;  // between the level of a keypoint and that on which the other camera sees its size
  double scale_factor = 1.2;     // scale factor of the pyramid
};

struct EpipolarMatch {
  KeypointIndex a, b;
  int hamming = 0;
};

// Best matches in order of `a`; each keypoint of b is matched to the most similar one of a only. All points of an
// epipolar plane have the same angle around the baseline. The keypoints of b are sorted by that angle, so that the
// candidates of a keypoint of a lie in a narrow window. Returns no matches if the baseline is shorter than a
// micrometre.
std::vector<EpipolarMatch> match_epipolar(const EpipolarView& a, const EpipolarView& b, const EpipolarOptions& options);

}  // namespace bslam::matching
