// Triangulation of a point from its pixels in two or more posed cameras: linear, then refined by reprojection error.
#pragma once

#include <optional>
#include <span>

#include "camera/camera.h"
#include "geometry/se3.h"

namespace bslam::matching {

struct PointObservation {
  const camera::Camera* camera = nullptr;
  geometry::SE3 T_cam_common;
  Eigen::Vector2d pixel;    // raw image
  Eigen::Vector3d bearing;  // unit, camera frame, of that pixel
  double sigma = 1.0;       // px, per axis
};

struct EstimatedPoint {
  Eigen::Vector3d point;       // metres, common frame
  Eigen::Matrix3d covariance;  // metres^2
  double worst_chi2 = 0;       // largest squared normalised error of an observation
  std::size_t worst = 0;       // index of that observation
  double parallax = 0;         // rad, largest angle between the rays to the point
};

// Returns nullopt if there are fewer than two observations, the parallax is less than `min_parallax` radians, or the
// point does not project into one of the cameras.
std::optional<EstimatedPoint> estimate_point(std::span<const PointObservation> observations, double min_parallax);

}  // namespace bslam::matching
