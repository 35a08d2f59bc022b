// Image pyramid: level 0 is the raw image; each level is smaller than the previous one by a constant factor.
#pragma once

#include <memory>
#include <vector>

#include "image/image.h"

namespace bslam::image {

struct Resampling;  // weights of the pixels of one level in those of the next

// Pixel (x, y) of level l lies at pixel ((x + 0.5) * scale(l) - 0.5, ...) of level 0, since pixel centres have integer
// coordinates.
struct Pyramid {
  std::vector<Image> levels;
  std::vector<double> scale_x, scale_y;  // pixels of level 0 per pixel of the level (exact: width_0 / width_l)
  double factor = 1.2;                   // that from each level to the next, but for the rounding of the sizes

  // Weights from each level to the next, for images of these sizes.
  std::vector<std::shared_ptr<const Resampling>> resampling;

  std::size_t size() const { return levels.size(); }
  double to_base_x(std::size_t level, double x) const { return (x + 0.5) * scale_x[level] - 0.5; }
  double to_base_y(std::size_t level, double y) const { return (y + 0.5) * scale_y[level] - 0.5; }
  double from_base_x(std::size_t level, double x) const { return (x + 0.5) / scale_x[level] - 0.5; }
  double from_base_y(std::size_t level, double y) const { return (y + 0.5) / scale_y[level] - 0.5; }
};

// Builds up to `levels` levels with ratio `factor`, in (1, 2], into `pyramid`, whose memory is reused. Levels with a
// side shorter than 32 pixels are omitted. Each level is resampled from the previous one with an anti-aliasing triangle
// filter.
void build_pyramid(const ImageView& base, int levels, double factor, Pyramid& pyramid);

}  // namespace bslam::image
