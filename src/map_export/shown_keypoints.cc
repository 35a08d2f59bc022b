#include "map_export/shown_keypoints.h"

#include <algorithm>

#include "feature/brief_pattern.h"
#include "feature/hamming.h"
#include "feature/smoothing.h"
#include "feature/window.h"
#include "image/pyramid.h"

namespace bslam::map_export {
namespace {

constexpr std::size_t kSample = 200;
// Bits of 256; positions have been refined since the descriptors were computed. Unrelated descriptors differ in 128 on
// average; those of one corner from slightly different places often in more than this.
constexpr int kSimilar = 32;

// Whether a window around a position is within an image.
bool has_window(const image::Image& image, double x, double y) {
  constexpr double kMargin = feature::kWindowReach;
  return x >= kMargin && y >= kMargin && x < image.width() - 1 - kMargin && y < image.height() - 1 - kMargin;
}

bool is_uniform(const feature::Window& window) {
  for (int row = 0; row < feature::kWindowRows; ++row) {
    const auto first = window.begin() + row * feature::kWindowStride;
    if (!std::all_of(first, first + feature::kWindowRows, [&](std::uint8_t grey) { return grey == window.front(); }))
      return false;
  }
  return true;
}

}  // namespace

std::optional<double> share_shown(const image::Image& image, const feature::Keypoints& keypoints,
                                  const feature::PyramidShape& shape) {
  image::Pyramid pyramid;
  image::build_pyramid(image.view(), shape.levels, shape.scale_factor, pyramid);
  feature::Smoother smoother;
  std::vector<image::Image> smooth(pyramid.size());
  const feature::Describer describer;
  std::size_t compared = 0, similar = 0;
  for (std::size_t i = 0; i < keypoints.size(); i += std::max(std::size_t{1}, keypoints.size() / kSample)) {
    const std::size_t level = keypoints.level[i];
    if (level >= pyramid.size()) continue;
    const double x = pyramid.from_base_x(level, keypoints.pixel[i].x());
    const double y = pyramid.from_base_y(level, keypoints.pixel[i].y());
    if (!has_window(pyramid.levels[level], x, y)) continue;
    if (smooth[level].empty()) smoother.smooth(pyramid.levels[level].view(), smooth[level]);
    const feature::Window window =
        feature::sample_window(smooth[level].view(), static_cast<float>(x), static_cast<float>(y));
    if (is_uniform(window)) continue;
    const feature::Descriptor here = describer.describe(window, keypoints.angle[i]);
    similar += feature::hamming(here, keypoints.descriptor[i]) <= kSimilar;
    ++compared;
  }
  if (compared == 0) return std::nullopt;
  return static_cast<double>(similar) / static_cast<double>(compared);
}

}  // namespace bslam::map_export
