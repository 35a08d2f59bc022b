// Selection of the corners that become keypoints: those with the highest scores, distributed over levels and over the
// image. Deterministic: corners of equal score are taken in row-major order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "feature/fast.h"

namespace bslam::feature {

// Part of a level in which corners are detected, in pixels of the level.
struct Region {
  int x = 0, y = 0, width = 0, height = 0;
  double area() const { return static_cast<double>(width) * height; }
};

// Distributes `wanted` keypoints over levels in proportion to their area. If a level has fewer corners `available`, the
// rest is distributed over the other levels. The numbers are written to `counts`, which must have the size of `area`
// and `available`; their sum is at most `wanted`.
void distribute_over_levels(std::span<const double> area, std::span<const std::size_t> available, std::size_t wanted,
                            std::span<std::size_t> counts);

// Distributes the corners of a level over the image. Reuses its memory between calls.
class Distribution {
 public:
  // `max_wanted`: maximum number of keypoints of a level.
  explicit Distribution(std::size_t max_wanted);

  // `ranked` becomes the indices of the best corners, best first, no two of which are closer than `spacing` pixels in
  // both axes: the greedy form of adaptive non-maximal suppression (Brown et al., CVPR 2005; Bailo et al., PRL 2018).
  void non_maximum_suppression(std::span<const Corner> corners, const Region& region, int spacing,
                               std::vector<std::uint32_t>& ranked);

  // Selects at most `wanted` (which must not exceed the constructor's `max_wanted`) of the `ranked` corners and writes
  // them to `chosen` in the order of `corners`. The region is divided into square cells of about kPerCell wanted
  // corners each. Every cell takes its best corners: those with a score above `strong_score`, and weaker ones only up
  // to an equal number per cell, so that the threshold adapts to cells with few strong corners. If some cells have
  // fewer corners, the others take more, all up to the same number; weak corners beyond the equal number are taken
  // last.
  void choose(std::span<const Corner> corners, std::span<const std::uint32_t> ranked, const Region& region,
              std::size_t wanted, int strong_score, std::vector<Corner>& chosen);

  static constexpr int kPerCell = 8;

 private:
  struct Cell {
    std::uint32_t total = 0, strong = 0;  // number of its corners
    std::uint32_t sure = 0, limit = 0;    // it takes `sure` corners, and up to `limit` while more are wanted
    std::uint32_t seen = 0;               // number of its corners visited during the selection
  };
  // Sets `sure` and `limit` of all cells.
  void set_limits(std::size_t wanted);

  std::vector<Cell> cells_;
  struct Entry {
    std::uint32_t pixel, index;  // packed pixel (not 0) and index of a corner
  };
  std::vector<Entry> order_;             // by score; contains the pixels for sequential memory access
  std::vector<std::uint32_t> occupied_;  // per square of side `spacing`: pixel of the selected corner in it, or 0
  std::vector<std::uint32_t> column_of_,
      row_of_;  // per pixel of the region's axes: column of its square or cell, index of the first one of its row
  std::vector<std::uint32_t> taken_, spare_;
};

}  // namespace bslam::feature
