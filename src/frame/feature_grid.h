// The paper's 64 x 48 grid of one camera, for finding the keypoints near a pixel.
#pragma once

#include <cstdint>
#include <vector>

#include "base/shared_array.h"
#include "feature/keypoints.h"

namespace bslam::frame {

// 64 columns by 48 rows of cells over the whole image; cells hold keypoint indices in ascending order.
// Immutable; copies share the cells.
class FeatureGrid {
 public:
  static constexpr int kColumns = 64, kRows = 48;

  FeatureGrid() = default;
  FeatureGrid(const feature::Keypoints& keypoints, int width, int height);

  // Appends to `out` the keypoints within `radius` pixels of `pixel` (in each axis) whose level is in [low, high].
  void near(const feature::Keypoints& keypoints, const Eigen::Vector2d& pixel, double radius, int low_level,
            int high_level, std::vector<std::uint32_t>& out) const;

  // The memory of the cells, unless it was counted before.
  std::size_t memory_bytes(MemoryCount& count) const { return begin_.memory_bytes(count) + index_.memory_bytes(count); }

 private:
  float cells_per_px_x_ = 0, cells_per_px_y_ = 0;
  SharedArray<std::uint32_t> begin_;  // kColumns * kRows + 1, row by row
  SharedArray<std::uint32_t> index_;
};

}  // namespace bslam::frame
