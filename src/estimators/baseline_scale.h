// Scale of points and a motion that are known up to scale, from the known position of another camera on the rig.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

namespace bslam::estimators {

// A point as another camera sees it: in that camera it has the direction scale * direction + offset, which should be
// that of the bearing.
struct BaselineObservation {
  Eigen::Vector3d direction;  // from the place of the camera to the point, up to scale, in the axes of the camera
  Eigen::Vector3d offset;     // from the place of the camera to that for which `direction` is given, metres
  Eigen::Vector3d bearing;    // unit vector
};

struct BaselineScaleOptions {
  double tolerance = 4e-3;  // rad, maximum angle between bearing and direction
  int min_agreeing = 15;
  double min_fraction = 0.3;  // that must agree, of the observations
  double max_deviation = 0.5;
};

struct BaselineScale {
  double scale = 1;      // metres per unit
  double deviation = 0;  // relative standard deviation
  int agreeing = 0;      // number of observations
};

// The scale with which most observations agree, refined over them. Its deviation is that of an error of the directions
// which is common to all observations and as large as their residuals, such as that of an interpolated motion. Returns
// nullopt if too few agree or if the scale is too uncertain, for example because all points are far away.
std::optional<BaselineScale> baseline_scale(std::span<const BaselineObservation> observations,
                                            const BaselineScaleOptions& options = {});

}  // namespace bslam::estimators
