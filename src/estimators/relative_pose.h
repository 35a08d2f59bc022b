// Relative pose of one central camera between two images, from bearings: how a map starts when nothing is metric yet.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/random.h"
#include "geometry/se3.h"

namespace bslam::estimators {

struct BearingPair {
  Eigen::Vector3d a, b;  // unit bearings of one point in the two images
};

struct RelativePoseOptions {
  int iterations = 300;        // RANSAC samples at most
  double inlier_angle = 2e-3;  // radians between a bearing and the epipolar plane of the other
  double min_parallax = 0.02;  // radians: median angle between the rays of the inliers; below it: nothing
  int min_inliers = 50;
};

struct RelativePose {
  geometry::SE3 T_b_a;                    // translation of norm 1
  std::vector<std::uint8_t> inlier;       // per pair
  std::vector<Eigen::Vector3d> points_a;  // triangulated in camera a, where inlier
  int num_inliers = 0;
  double median_parallax = 0.0;  // radians
};

// Five-point algorithm (Nister, PAMI 2004, by OpenGV) in a seeded RANSAC, refined over all inliers; points behind a
// camera are no inliers. Empty where support or parallax does not suffice or two solutions fit about equally well.
std::optional<RelativePose> relative_pose(std::span<const BearingPair> pairs, const RelativePoseOptions& options,
                                          Random random);

}  // namespace bslam::estimators
