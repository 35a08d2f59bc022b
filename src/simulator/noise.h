// Lattice noise for procedural textures, as pure functions of position and seed.
#pragma once

#include <cmath>
#include <cstdint>

namespace bslam::simulator {

// A hash of a lattice point.
inline std::uint32_t hash(std::int32_t x, std::int32_t y, std::uint32_t seed) {
  std::uint32_t h = seed + static_cast<std::uint32_t>(x) * 0x9e3779b1u + static_cast<std::uint32_t>(y) * 0x85ebca77u;
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h = (h ^ (h >> 12)) * 0x297a2d39u;
  return h ^ (h >> 15);
}

// Uniform in [0, 1).
inline float unit(std::uint32_t h) { return static_cast<float>(h >> 8) * 0x1p-24f; }
inline float unit(std::int32_t x, std::int32_t y, std::uint32_t seed) { return unit(hash(x, y, seed)); }

inline std::int32_t floor_int(float x) {
  const auto i = static_cast<std::int32_t>(x);
  return i - (static_cast<float>(i) > x ? 1 : 0);
}

// 0 below `low`, 1 above `high`, and smooth in between.
inline float smooth_step(float low, float high, float x) {
  float t = (x - low) / (high - low);
  t = t < 0 ? 0.0f : t > 1 ? 1.0f : t;
  return t * t * (3 - 2 * t);
}

inline float mix(float a, float b, float fraction) { return a + (b - a) * fraction; }

// Value noise in [-1, 1] with features of size 1.
inline float value_noise(float x, float y, std::uint32_t seed) {
  const std::int32_t ix = floor_int(x), iy = floor_int(y);
  float fx = x - static_cast<float>(ix), fy = y - static_cast<float>(iy);
  fx = fx * fx * (3 - 2 * fx);
  fy = fy * fy * (3 - 2 * fy);
  const float top = mix(unit(ix, iy, seed), unit(ix + 1, iy, seed), fx);
  const float bottom = mix(unit(ix, iy + 1, seed), unit(ix + 1, iy + 1, seed), fx);
  return 2 * mix(top, bottom, fy) - 1;
}

// Sum of octaves, each with half the feature size and `gain` times the amplitude of the previous one; roughly in [-1,
// 1].
inline float fractal_noise(float x, float y, std::uint32_t seed, int octaves, float gain = 0.6f) {
  float sum = 0, amplitude = 1, total = 0;
  for (int i = 0; i < octaves; ++i) {
    sum += amplitude * value_noise(x, y, seed + static_cast<std::uint32_t>(i) * 0x51ed27u);
    total += amplitude;
    amplitude *= gain;
    x = 2.03f * x + 13.7f;  // not exactly 2, so that the lattices of the octaves do not coincide
    y = 2.03f * y + 7.1f;
  }
  return sum / total;
}

}  // namespace bslam::simulator
