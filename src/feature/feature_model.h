// What all stages must know of the features: on which scales they are found and how large a keypoint's error is.
#pragma once

#include <cmath>

namespace bslam::feature {

// The pyramid keypoints are found on.
struct PyramidShape {
  double scale_factor = 1.2;  // between neighbouring levels
  int levels = 8;

  // Level-0 pixels per pixel of a level.
  double scale(double level) const { return std::pow(scale_factor, level); }
};

struct FeatureModel {
  double sigma_px = 0.4;  // standard deviation of a detected keypoint, not aligned, per axis, in pixels of its level
  PyramidShape pyramid = {};

  // The same in level-0 pixels.
  double sigma(int level) const { return sigma_px * pyramid.scale(level); }
};

}  // namespace bslam::feature
