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

Moments intensity_moments(const Window& window);
Moments intensity_moments_scalar(const Window& window);

// Angle of the centroid in radians, (-pi, pi], x towards y; 0 if there is none.
float orientation(const Moments& moments);

}  // namespace bslam::feature
