#include "feature/window.h"

#include <cmath>

#include "base/vectorised.h"

namespace bslam::feature {
namespace {

// Bilinear sampling at a fixed fraction of a pixel: integer part, and weights with the sum kOne^2.
template <int kOne>
struct Phase {
  int x, y;
  // Weights of the pixel itself, its right neighbour, its lower neighbour and its lower right neighbour.
  int w00, w01, w10, w11;

  Phase(float px, float py) : x(static_cast<int>(std::floor(px))), y(static_cast<int>(std::floor(py))) {
    const int right = static_cast<int>(std::lround((px - static_cast<float>(x)) * kOne));
    const int below = static_cast<int>(std::lround((py - static_cast<float>(y)) * kOne));
    w00 = (kOne - right) * (kOne - below);
    w01 = right * (kOne - below);
    w10 = (kOne - right) * below;
    w11 = right * below;
  }
};

// One row of a window; 16 bits hold the sums: 255 * 256 + 128 < 2^16.
[[gnu::always_inline]] inline void blend_row(const std::uint8_t* __restrict a, const std::uint8_t* __restrict b,
                                             const Phase<16>& phase, std::uint8_t* __restrict out) {
  const auto w00 = static_cast<std::uint16_t>(phase.w00), w01 = static_cast<std::uint16_t>(phase.w01);
  const auto w10 = static_cast<std::uint16_t>(phase.w10), w11 = static_cast<std::uint16_t>(phase.w11);
  for (int i = 0; i < kWindowStride; ++i) {
    const auto sum = static_cast<std::uint16_t>(w00 * a[i] + w01 * a[i + 1] + w10 * b[i] + w11 * b[i + 1] + 128);
    out[i] = static_cast<std::uint8_t>(sum >> 8);
  }
}

BSLAM_VECTORISED void sample_rows(const std::uint8_t* row, std::ptrdiff_t stride, const Phase<16>& phase,
                                  std::uint8_t* out) {
  for (int j = 0; j < kWindowRows; ++j, row += stride, out += kWindowStride) blend_row(row, row + stride, phase, out);
}

}  // namespace

Window sample_window(const image::ImageView& level, float x, float y) {
  const Phase<16> phase(x, y);
  Window window;
  sample_rows(level.row(phase.y - kWindowRadius) + phase.x - kWindowRadius, level.stride, phase, window.data());
  return window;
}

Patch sample_patch(const image::ImageView& level, float x, float y) {
  constexpr int kOne = 128;
  constexpr float kFirst = 0.5f - kPatchSize / 2;  // offset of the first sample from the keypoint
  const Phase<kOne> phase(x + kFirst, y + kFirst);
  Patch patch;
  const std::uint8_t* a = level.row(phase.y) + phase.x;
  for (int j = 0; j < kPatchSize; ++j, a += level.stride) {
    const std::uint8_t* b = a + level.stride;
    for (int i = 0; i < kPatchSize; ++i) {
      const int sum = phase.w00 * a[i] + phase.w01 * a[i + 1] + phase.w10 * b[i] + phase.w11 * b[i + 1];
      patch[j * kPatchSize + i] = static_cast<std::uint8_t>((sum + kOne * kOne / 2) / (kOne * kOne));
    }
  }
  return patch;
}

}  // namespace bslam::feature
