// Orientation by intensity centroid (Rosin, CVIU 1999; Rublee et al., ICCV 2011).
#pragma once

#include <cstdint>

#include "feature/window.h"

namespace bslam::feature {

// First moments of the grey values in the disc of radius kWindowRadius around a keypoint.
struct Moments {
  std::int32_t x = 0, y = 0;
  friend bool operator==(const Moments&, const Moments&) = default;
};

// Sums of x * grey and of y * grey, x and y in pixels of the level relative to the keypoint.
Moments intensity_moments(const Window& window);
// The same without SIMD. Both give identical results.
Moments intensity_moments_scalar(const Window& window);

// Angle of the centroid in radians, (-pi, pi], x towards y; 0 if both moments are zero.
float orientation(const Moments& moments);

}  // namespace bslam::feature
