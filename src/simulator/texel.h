// Texels of the albedo of surfaces.
#pragma once

#include <cstdint>

#include "simulator/surface.h"

namespace bslam::simulator {

using Eigen::Vector2f;

// The number of samples of the albedo in each direction, of which a texel is the mean. `texel` is its size in metres;
// the spacing is that of WorldOptions.
int samples_per_texel(double sample_spacing, double texel);

// Mean albedo of texel (x, y) of a surface of a size in metres and a number of texels.
float mean_albedo(const Surface& s, float x, float y, const Vector2f& size, const Vector2f& texels, int samples);

struct TexelGrid {
  std::int32_t width, height;
};

// The next level of a texture pyramid. Texels hold square roots of albedo: each texel of `out` is the root of the mean
// square of the four texels of `in` that it covers; the last row and column of `in` are repeated.
void halve(const std::uint8_t* in, const TexelGrid& fine, std::uint8_t* out, const TexelGrid& coarse);

}  // namespace bslam::simulator
