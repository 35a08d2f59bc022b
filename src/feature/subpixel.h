// Sub-pixel position of a corner.
#pragma once

#include <Eigen/Core>

#include "feature/fast.h"
#include "image/image.h"

namespace bslam::feature {

// Offset in pixels of the level from the corner's pixel to the Gaussian-weighted centroid of the FAST scores (at
// threshold 0, of the same kind as the corner: dark or bright) of the 5 x 5 pixels around it, multiplied by 1.5 to
// correct the bias of the weights. Zero if it exceeds 1 pixel in an axis.
//
// On views of one scene under known warps (tests/feature/subpixel_test.cc) the median error of a pair's positions
// decreases from 0.65-0.76 px for whole pixels to 0.26-0.34 px. Other methods were compared once, outside of this test,
// on views where these errors are 0.71 px and 0.28-0.29 px: it was 0.34-0.42 px for a quadratic fit to the 3 x 3
// scores, 0.32-0.50 px for a quadratic fit to a difference of Gaussians, and 0.71 px for Foerstner's gradient method or
// a fit to the Harris response, because FAST responds at a small distance from the positions that these find.
//
// `x`, `y` must be at least 11 pixels from the border of `level`.
Eigen::Vector2f refine(const image::ImageView& level, int x, int y, const FastKernels& kernels = fast_kernels());

}  // namespace bslam::feature
