// What the map's stages must know of the features: how large a keypoint's error is, and on which scale it was found.
#pragma once

#include <cmath>

namespace bslam::map {

struct FeatureModel {
  double sigma_px = 0.4;      // standard deviation of a keypoint on its level, not aligned
  double scale_factor = 1.2;  // of the pyramid

  // Standard deviation in level-0 pixels, per axis.
  double sigma(int level) const { return sigma_px * std::pow(scale_factor, level); }
};

}  // namespace bslam::map
