// Which corners become keypoints: the best, yet spread over levels and over the image. Deterministic: equal scores are
// taken in reading order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "feature/fast.h"

namespace bslam::feature {

// Part of a level in which corners are looked for, in pixels of the level.
struct Region {
  int x = 0, y = 0, width = 0, height = 0;
  double area() const { return static_cast<double>(width) * height; }
};

// Shares `wanted` keypoints over levels by area; what a level has not `available` goes to the others by area.
// `share` (same size as `area` and `available`) is filled; it adds up to at most `wanted`.
void share_over_levels(std::span<const double> area, std::span<const std::size_t> available, std::size_t wanted,
                       std::span<std::size_t> share);

// Spreads the corners of a level; keeps its memory from call to call.
class Distribution {
 public:
  // Makes room for `most_wanted` keypoints of a level.
  explicit Distribution(std::size_t most_wanted);

  // `ranked` becomes the indices of the best corners, best first, no two of which are closer than `spacing` pixels in
  // both axes: the greedy form of adaptive non-maximal suppression (Brown et al., CVPR 2005; Bailo et al., PRL 2018).
  void non_maximum_suppression(std::span<const Corner> corners, const Region& region, int spacing,
                               std::vector<std::uint32_t>& ranked);

  // Chooses at most `wanted` (no more than the constructor was told) of the `ranked` corners and writes them to
  // `chosen` in the order of `corners`. The region is divided into square cells of about kPerCell wanted corners each.
  // Every cell takes its best: those with a score above `strong_score`, and weaker ones only up to its equal share,
  // which is the adaptive threshold: it drops where a cell has too few strong corners. Where cells have fewer, the
  // others take more, all up to the same number; weak corners beyond the equal share are taken last.
  void choose(std::span<const Corner> corners, std::span<const std::uint32_t> ranked, const Region& region,
              std::size_t wanted, int strong_score, std::vector<Corner>& chosen);

  static constexpr int kPerCell = 8;

 private:
  struct Cell {
    std::uint32_t total = 0, strong = 0;  // corners it has
    std::uint32_t sure = 0, limit = 0;    // takes `sure`, and up to `limit` as long as there are corners wanted
    std::uint32_t seen = 0;               // while corners are given out
  };
  // Sets `sure` and `limit` of all cells.
  void set_limits(std::size_t wanted);

  std::vector<Cell> cells_;
  struct Entry {
    std::uint32_t pixel, index;  // of a corner: its pixel, packed and not 0
  };
  std::vector<Entry> order_;             // by score; holds the pixels so that they are read in a row
  std::vector<std::uint32_t> occupied_;  // per square of side `spacing`: the pixel of the corner in it, or 0
  std::vector<std::uint32_t> column_of_,
      row_of_;  // per pixel of the region's axes: its square's or cell's column, row's begin
  std::vector<std::uint32_t> taken_, spare_;
};

}  // namespace bslam::feature
