// Matching keypoints of two posed cameras along epipolar planes, without rectification and for any camera model.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/id.h"
#include "camera/camera.h"
#include "feature/feature_model.h"
#include "feature/keypoints.h"
#include "geometry/se3.h"

namespace bslam::matching {

// A camera with its keypoints and its pose in a frame common to both views.
struct EpipolarView {
  const camera::Camera* camera = nullptr;
  const feature::Keypoints* keypoints = nullptr;
  geometry::SE3 T_common_cam;
  std::span<const std::uint8_t> usable;  // per keypoint, 0 = leave out; empty = all
  // Gives the keypoints' standard deviations where the views are of different frames. Null: each keypoint's own, which
  // holds between cameras of one frame.
  const feature::FeatureModel* features = nullptr;
};

struct EpipolarOptions {
  double min_depth_m = 0.2;  // least distance of a point from the first camera, metres
  double far_m = 1e9;        // largest distance, metres
  double sigmas = 3.0;       // distance from the epipolar plane, in standard deviations of both keypoints
  int max_hamming = 60;      // of 256 bits
  double ratio = 0.85;       // best to second best descriptor distance at another place on the curve
  int max_level_difference = 2;
};

struct EpipolarMatch {
  KeypointIndex a, b;
  int hamming = 0;
};

// Best matches in order of `a`, each keypoint of b with the one of a that fits it best. All points of one epipolar
// plane have the same angle about the baseline, so the keypoints of b sorted by that angle give each keypoint of a its
// candidates in a narrow window. Empty where the baseline is shorter than a micrometre.
std::vector<EpipolarMatch> match_epipolar(const EpipolarView& a, const EpipolarView& b, const EpipolarOptions& options);

}  // namespace bslam::matching
