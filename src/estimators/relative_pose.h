// Relative pose of one central camera between two images from bearings, for monocular initialisation.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/random.h"
#include "camera/camera.h"
#include "geometry/se3.h"

namespace bslam::estimators {

struct BearingPair {
  Eigen::Vector3d a, b;  // unit bearings of one point in the two images
};

// Pixels of one point in two images.
struct PixelPair {
  Eigen::Vector2d a, b;
};

// The bearings of the pairs of which both pixels have one, in order.
std::vector<BearingPair> bearing_pairs(std::span<const PixelPair> pixels, const camera::Camera& of_a,
                                       const camera::Camera& of_b);

struct RelativePoseOptions {
  int iterations = 300;        // maximum number of RANSAC samples
  double inlier_angle = 2e-3;  // rad, maximum angle between a bearing and the epipolar plane of the other
  double min_parallax = 0.02;  // rad, minimum median angle between the rays of the inliers
  int min_inliers = 50;
  // Points that have not moved are outliers if the others clearly have: for two images of a moving camera, in which a
  // part of the robot can be seen.
  bool leave_out_unmoved = false;
};

struct RelativePose {
  geometry::SE3 T_b_a;                    // translation of norm 1
  std::vector<std::uint8_t> inlier;       // per pair
  std::vector<Eigen::Vector3d> points_a;  // triangulated points of the inliers in camera a, per pair
  int num_inliers = 0;
  double median_parallax = 0.0;  // radians
};

// Five-point algorithm (Nister, PAMI 2004, by OpenGV) in a seeded RANSAC, refined over all inliers; points behind a
// camera are outliers. Returns nullopt if there are too few inliers or too little parallax, or if the solution is
// ambiguous.
std::optional<RelativePose> relative_pose(std::span<const BearingPair> pairs, const RelativePoseOptions& options,
                                          Random random);

}  // namespace bslam::estimators
