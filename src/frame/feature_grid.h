// The paper's 64 x 48 grid of one camera, for finding the keypoints near a pixel.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/memory_count.h"
#include "feature/keypoints.h"

namespace bslam::frame {

// 64 columns by 48 rows of cells over the whole image; cells hold keypoint indices in ascending order.
// Immutable; copies share the cells. They are filled at the first search, in whichever thread that is, so that
// keyframes that are never searched need no memory for them.
class FeatureGrid {
 public:
  static constexpr int kColumns = 64, kRows = 48;

  FeatureGrid() = default;
  FeatureGrid(const feature::Keypoints& keypoints, int width, int height);

  // Appends to `out` the keypoints within `radius` pixels of `pixel` (in each axis) whose level is in [low, high].
  void near(const feature::Keypoints& keypoints, const Eigen::Vector2d& pixel, double radius, int low_level,
            int high_level, std::vector<std::uint32_t>& out) const;

  // The same grid with cells that are not filled yet.
  FeatureGrid emptied() const;

  // The memory of the cells, unless it was counted before.
  std::size_t memory_bytes(MemoryCount& count) const;

 private:
  struct Cells;
  std::shared_ptr<Cells> cells_;  // null without keypoints
};

}  // namespace bslam::frame
