#include "simulator/texel.h"

#include <algorithm>
#include <cmath>

namespace bslam::simulator {

int samples_per_texel(double sample_spacing, double texel) {
  return sample_spacing > 0 && texel > sample_spacing ? 2 : 1;
}

float mean_albedo(const Surface& s, float x, float y, const Vector2f& size, const Vector2f& texels, int samples) {
  const auto x0 = static_cast<float>(s.pattern_origin.x()), y0 = static_cast<float>(s.pattern_origin.y());
  float sum = 0;
  for (int j = 0; j < samples; ++j) {
    const float py = y0 + (y + (static_cast<float>(j) + 0.5f) / static_cast<float>(samples)) * size.y() / texels.y();
    for (int i = 0; i < samples; ++i) {
      const float px = x0 + (x + (static_cast<float>(i) + 0.5f) / static_cast<float>(samples)) * size.x() / texels.x();
      sum += albedo(s.texture, px, py, size.x(), size.y());
    }
  }
  return sum / static_cast<float>(samples * samples);
}

void halve(const std::uint8_t* in, const TexelGrid& fine, std::uint8_t* out, const TexelGrid& coarse) {
  const auto square = [&](std::int32_t x, std::int32_t y) {
    const std::int32_t v = in[std::min(y, fine.height - 1) * fine.width + std::min(x, fine.width - 1)];
    return v * v;
  };
  for (std::int32_t y = 0; y < coarse.height; ++y) {
    for (std::int32_t x = 0; x < coarse.width; ++x) {
      const std::int32_t sum =
          square(2 * x, 2 * y) + square(2 * x + 1, 2 * y) + square(2 * x, 2 * y + 1) + square(2 * x + 1, 2 * y + 1);
      out[y * coarse.width + x] = static_cast<std::uint8_t>(0.5f * std::sqrt(static_cast<float>(sum)) + 0.5f);
    }
  }
}

}  // namespace bslam::simulator
