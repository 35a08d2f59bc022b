// Lines of sight of the map: from the cameras of the keyframes to the landmarks they observe. The space along them is
// free.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "map_export/selection.h"

namespace bslam::map_export {

struct Ray {
  Eigen::Vector3d end;  // the landmark, in upright axes
  double sigma = 0;     // standard deviation of the landmark along the ray, in map units
};

// All rays of one image.
struct Scan {
  Eigen::Vector3d origin;  // the camera, in upright axes
  double height = 0;       // z of camera 0 of the keyframe
  std::vector<Ray> rays;
};

// One scan for each image with landmarks. Landmarks whose position the observations do not determine, and landmarks of
// a single keyframe unless several of its cameras see them, have no rays.
std::vector<Scan> scans_of(const Selection& selection);

// How space is carved along rays.
struct CarvingOptions {
  double resolution = 0.1;  // side of a cell, in map units
  double max_range = 50;    // in map units: of a longer ray only this part is free, and its end is not occupied
};

// The part of a ray that is free, and whether its end is occupied: the end of an uncertain landmark is not, and the ray
// is free until two standard deviations before it.
struct CarvedRay {
  Eigen::Vector3d free_end;
  bool occupied = false;
};
CarvedRay carve(const Eigen::Vector3d& origin, const Ray& ray, const CarvingOptions& options);

// A cell size for a scene at the given median distance: a fortieth of it, rounded down to 1, 2 or 5 times a power of
// ten.
double default_resolution(double median_depth);

}  // namespace bslam::map_export
