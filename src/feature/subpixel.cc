#include "feature/subpixel.h"

#include <array>
#include <cstdint>

namespace bslam::feature {
namespace {

constexpr int kHalf = 2, kSide = 2 * kHalf + 1;
constexpr float kLargest = 1.0f;  // pixels

// Weights exp(-d^2 / (2 * 1.2^2)) suppress adjacent corners, but bias the centroid towards the middle of the window.
// The gain corrects this for scores that decrease like a Gaussian of sigma 0.85: 1 + 0.85^2 / 1.2^2.
constexpr float kGain = 1.5f;
constexpr std::array<float, kSide> kWeight{0.2494f, 0.7066f, 1.0f, 0.7066f, 0.2494f};

}  // namespace

Eigen::Vector2f refine(const image::ImageView& level, int x, int y, const FastKernels& kernels) {
  constexpr int kBlock = 16, kBefore = 8;  // a full vector of pixels is as fast as five pixels
  using Rows = std::array<std::array<std::uint8_t, kBlock>, kSide>;
  Rows dark, bright;
  for (int j = 0; j < kSide; ++j) {
    kernels.kinds_row(level.row(y + j - kHalf) + x - kBefore, level.stride, 0, kBlock, dark[j].data(),
                      bright[j].data());
  }
  const Rows& scores = dark[kHalf][kBefore] >= bright[kHalf][kBefore] ? dark : bright;
  float total = 0, sum_x = 0, sum_y = 0;
  for (int j = -kHalf; j <= kHalf; ++j) {
    for (int i = -kHalf; i <= kHalf; ++i) {
      const float w = kWeight[i + kHalf] * kWeight[j + kHalf] * static_cast<float>(scores[j + kHalf][kBefore + i]);
      total += w;
      sum_x += w * static_cast<float>(i);
      sum_y += w * static_cast<float>(j);
    }
  }
  if (!(total > 0)) return Eigen::Vector2f::Zero();
  const Eigen::Vector2f offset = Eigen::Vector2f(sum_x, sum_y) * (kGain / total);
  return offset.cwiseAbs().maxCoeff() <= kLargest ? offset : Eigen::Vector2f::Zero().eval();
}

}  // namespace bslam::feature
