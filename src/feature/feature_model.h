// Properties of the features that all stages use: the scales of the pyramid and the standard deviation of a keypoint.
#pragma once

#include <cmath>

namespace bslam::feature {

// The pyramid on which keypoints are detected.
struct PyramidShape {
  double scale_factor = 1.2;  // scale factor between adjacent levels
  int levels = 8;

  // Level-0 pixels per pixel of a level.
  double scale(double level) const { return std::pow(scale_factor, level); }
};

struct FeatureModel {
  double sigma_px = 0.4;  // standard deviation of a detected (not aligned) keypoint per axis, in pixels of its level
  PyramidShape pyramid = {};

  // The same in level-0 pixels.
  double sigma(int level) const { return sigma_px * pyramid.scale(level); }
};

}  // namespace bslam::feature
