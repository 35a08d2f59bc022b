// Low passes that corners are detected on and that binary tests are made on. Edges are repeated.
#pragma once

#include <cstdint>
#include <vector>

#include "image/image.h"

namespace bslam::feature {

// Keeps its memory from image to image. `out` takes the size of `in`.
class Smoother {
 public:
  // 1 2 1 in both axes. Corners found on this come back more often in another view than corners of the level itself:
  // noise decides less about which pixel of a weak corner is the best (extractor.cc has the figures).
  void soften(const image::ImageView& in, image::Image& out);

  // 1 2 3 4 3 2 1 in both axes: two boxes of 4; standard deviation 1.58 pixels, that of a Gaussian of sigma 2 cut off
  // after 7 taps.
  void smooth(const image::ImageView& in, image::Image& out);

 private:
  template <class Kernel>
  void filter(const image::ImageView& in, image::Image& out);

  std::vector<std::uint16_t> row_;  // one row after the vertical pass, wider by half a kernel on either side
};

}  // namespace bslam::feature
