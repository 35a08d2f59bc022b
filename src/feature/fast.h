// FAST-9 corners (Rosten & Drummond, ECCV 2006): 9 contiguous pixels of the 16 on a circle of radius 3 are all brighter
// than the centre by more than a threshold, or all darker.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "image/image.h"

namespace bslam::feature {

// `score` is the largest threshold plus one at which the pixel is a corner: it is a corner at threshold t if score > t.
struct Corner {
  std::uint16_t x, y;  // pixel of the level
  std::uint8_t score;
};

// The functions of the detector for one instruction set. All instruction sets give identical results.
struct FastKernels {
  // Writes scores[x] for x in [begin, end) of the image row `row`, 0 if the score is at most `threshold`. Reads the
  // three rows above and below, and three pixels to either side.
  void (*score_row)(const std::uint8_t* row, std::ptrdiff_t stride, int begin, int end, int threshold,
                    std::uint8_t* scores);
  // The same at threshold 0, separately for corners darker than the circle (`dark`) and brighter ones (`bright`).
  void (*kinds_row)(const std::uint8_t* row, std::ptrdiff_t stride, int begin, int end, std::uint8_t* dark,
                    std::uint8_t* bright);
  // Writes to `out` the x in [begin, end) at which `scores` is positive and the maximum of its 3 x 3 neighbourhood (on
  // ties the first in row-major order), and returns their number. Reads one entry to either side. `out` must be large
  // enough.
  std::size_t (*local_maxima)(const std::uint8_t* above, const std::uint8_t* scores, const std::uint8_t* below,
                              int begin, int end, std::uint16_t* out);
};

const FastKernels& scalar_fast_kernels();
const FastKernels& fast_kernels();  // the fastest that this program was compiled for

// Detection with 3 x 3 non-maximum suppression. Reuses its memory between images.
class FastDetector {
 public:
  explicit FastDetector(const FastKernels& kernels = fast_kernels()) : kernels_(&kernels) {}

  // Fills `corners` (cleared first) with the corners whose score exceeds `threshold`, at least `border` (>= 4) pixels
  // from the border of `image`, row by row.
  void detect(const image::ImageView& image, int border, int threshold, std::vector<Corner>& corners);

 private:
  const FastKernels* kernels_;
  std::vector<std::uint8_t> scores_;    // three rows, used in turn
  std::vector<std::uint16_t> columns_;  // maxima of one row
};

}  // namespace bslam::feature
