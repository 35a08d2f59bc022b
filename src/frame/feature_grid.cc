#include "frame/feature_grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace bslam::frame {
namespace {

int cell_of(float coordinate, float cells_per_px, int count) {
  return std::clamp(static_cast<int>(std::floor((coordinate + 0.5f) * cells_per_px)), 0, count - 1);
}

}  // namespace

FeatureGrid::FeatureGrid(const feature::Keypoints& keypoints, int width, int height)
    : cells_per_px_x_(static_cast<float>(kColumns) / static_cast<float>(width)),
      cells_per_px_y_(static_cast<float>(kRows) / static_cast<float>(height)) {
  std::vector<std::uint32_t> cell(keypoints.size());
  std::vector<std::uint32_t> begin(kColumns * kRows + 1, 0);
  for (std::size_t k = 0; k < keypoints.size(); ++k) {
    const Eigen::Vector2f& p = keypoints.pixel[k];
    cell[k] = static_cast<std::uint32_t>(cell_of(p.y(), cells_per_px_y_, kRows) * kColumns +
                                         cell_of(p.x(), cells_per_px_x_, kColumns));
    ++begin[cell[k] + 1];
  }
  for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
  std::vector<std::uint32_t> index(keypoints.size());
  std::vector<std::uint32_t> fill(begin.begin(), begin.end() - 1);
  for (std::size_t k = 0; k < keypoints.size(); ++k) index[fill[cell[k]]++] = static_cast<std::uint32_t>(k);
  begin_ = std::move(begin);
  index_ = std::move(index);
}

void FeatureGrid::near(const feature::Keypoints& keypoints, const Eigen::Vector2d& pixel, double radius, int low_level,
                       int high_level, std::vector<std::uint32_t>& out) const {
  if (index_.empty()) return;
  const float x = static_cast<float>(pixel.x()), y = static_cast<float>(pixel.y()), r = static_cast<float>(radius);
  const int first_column = cell_of(x - r, cells_per_px_x_, kColumns),
            last_column = cell_of(x + r, cells_per_px_x_, kColumns);
  const int first_row = cell_of(y - r, cells_per_px_y_, kRows), last_row = cell_of(y + r, cells_per_px_y_, kRows);
  for (int row = first_row; row <= last_row; ++row) {
    const std::size_t from = begin_[static_cast<std::size_t>(row * kColumns + first_column)];
    const std::size_t to = begin_[static_cast<std::size_t>(row * kColumns + last_column + 1)];
    for (std::size_t i = from; i < to; ++i) {
      const std::uint32_t k = index_[i];
      const Eigen::Vector2f& p = keypoints.pixel[k];
      if (std::abs(p.x() - x) > r || std::abs(p.y() - y) > r) continue;
      if (keypoints.level[k] < low_level || keypoints.level[k] > high_level) continue;
      out.push_back(k);
    }
  }
}

}  // namespace bslam::frame
