#include "frame/feature_grid.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <utility>

namespace bslam::frame {
namespace {

int cell_of(float coordinate, float cells_per_px, int count) {
  return std::clamp(static_cast<int>(std::floor((coordinate + 0.5f) * cells_per_px)), 0, count - 1);
}

}  // namespace

struct FeatureGrid::Cells {
  Cells(SharedArray<Eigen::Vector2f> of, float per_px_in_x, float per_px_in_y)
      : pixel(std::move(of)), per_px_x(per_px_in_x), per_px_y(per_px_in_y) {}

  SharedArray<Eigen::Vector2f> pixel;
  float per_px_x, per_px_y;
  std::once_flag once = {};
  std::atomic<bool> filled = false;       // for memory_bytes, which does not fill them
  std::vector<std::uint32_t> begin = {};  // kColumns * kRows + 1, row by row
  std::vector<std::uint32_t> index = {};

  void fill() {
    std::vector<std::uint16_t> cell(pixel.size());
    begin.assign(kColumns * kRows + 1, 0);
    for (std::size_t k = 0; k < pixel.size(); ++k) {
      const Eigen::Vector2f& p = pixel[k];
      cell[k] =
          static_cast<std::uint16_t>(cell_of(p.y(), per_px_y, kRows) * kColumns + cell_of(p.x(), per_px_x, kColumns));
      ++begin[cell[k] + std::size_t{1}];
    }
    for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
    index.resize(pixel.size());
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for (std::size_t k = 0; k < pixel.size(); ++k) index[next[cell[k]]++] = static_cast<std::uint32_t>(k);
    filled.store(true, std::memory_order_release);
  }
};

FeatureGrid::FeatureGrid(const feature::Keypoints& keypoints, int width, int height) {
  if (keypoints.empty()) return;
  cells_ = std::make_shared<Cells>(keypoints.pixel, static_cast<float>(kColumns) / static_cast<float>(width),
                                   static_cast<float>(kRows) / static_cast<float>(height));
}

FeatureGrid FeatureGrid::emptied() const {
  FeatureGrid out;
  if (cells_) out.cells_ = std::make_shared<Cells>(cells_->pixel, cells_->per_px_x, cells_->per_px_y);
  return out;
}

std::size_t FeatureGrid::memory_bytes(MemoryCount& count) const {
  if (!cells_) return 0;
  std::size_t own = sizeof(Cells) + MemoryCount::kShared;
  if (cells_->filled.load(std::memory_order_acquire))
    own += bslam::memory_bytes(cells_->begin) + bslam::memory_bytes(cells_->index);
  return count.once(cells_.get(), own);
}

void FeatureGrid::near(const feature::Keypoints& keypoints, const Eigen::Vector2d& pixel, double radius, int low_level,
                       int high_level, std::vector<std::uint32_t>& out) const {
  if (!cells_) return;
  std::call_once(cells_->once, [this] { cells_->fill(); });
  const Cells& cells = *cells_;
  const float x = static_cast<float>(pixel.x()), y = static_cast<float>(pixel.y()), r = static_cast<float>(radius);
  const int first_column = cell_of(x - r, cells.per_px_x, kColumns),
            last_column = cell_of(x + r, cells.per_px_x, kColumns);
  const int first_row = cell_of(y - r, cells.per_px_y, kRows), last_row = cell_of(y + r, cells.per_px_y, kRows);
  for (int row = first_row; row <= last_row; ++row) {
    const std::size_t from = cells.begin[static_cast<std::size_t>(row * kColumns + first_column)];
    const std::size_t to = cells.begin[static_cast<std::size_t>(row * kColumns + last_column + 1)];
    for (std::size_t i = from; i < to; ++i) {
      const std::uint32_t k = cells.index[i];
      const Eigen::Vector2f& p = keypoints.pixel[k];
      if (std::abs(p.x() - x) > r || std::abs(p.y() - y) > r) continue;
      if (keypoints.level[k] < low_level || keypoints.level[k] > high_level) continue;
      out.push_back(k);
    }
  }
}

}  // namespace bslam::frame
