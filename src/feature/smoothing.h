// Low-pass filters for the images in which corners are detected and binary tests are evaluated. Border pixels are
// repeated.
#pragma once

#include <cstdint>
#include <vector>

#include "image/image.h"

namespace bslam::feature {

// Reuses its memory between images. `out` is resized to the size of `in`.
class Smoother {
 public:
  // 1 2 1 in both axes. Corners detected in the result are more repeatable than corners of the level itself, because
  // noise has less influence on the maximum of a weak corner (measurements: extractor.cc).
  void soften(const image::ImageView& in, image::Image& out);

  // 1 2 3 4 3 2 1 in both axes: two boxes of 4. The standard deviation is 1.58 pixels, as for a Gaussian of sigma 2
  // truncated to 7 taps.
  void smooth(const image::ImageView& in, image::Image& out);

 private:
  template <class Kernel>
  void filter(const image::ImageView& in, image::Image& out);

  std::vector<std::uint16_t> row_;  // one row after the vertical pass, wider by half a kernel on either side
};

}  // namespace bslam::feature
