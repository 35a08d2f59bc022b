#include "feature/distribution.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "base/assert.h"

namespace bslam::feature {
namespace {

// Packs a pixel into one number that is not 0.
std::uint32_t packed(const Corner& c) { return (static_cast<std::uint32_t>(c.y) << 16) + c.x + 1; }
int x_of(std::uint32_t pixel) { return static_cast<int>((pixel - 1) & 0xFFFF); }
int y_of(std::uint32_t pixel) { return static_cast<int>((pixel - 1) >> 16); }

// First indices of the corners of equal score in descending order of score; [255 - score] belongs to `score`.
std::array<std::uint32_t, 257> score_runs(std::span<const Corner> corners) {
  std::array<std::uint32_t, 257> begin{};
  for (const Corner& c : corners) ++begin[256 - c.score];
  for (std::size_t s = 1; s < begin.size(); ++s) begin[s] += begin[s - 1];
  return begin;
}

// of[i] = index(i) for the `length` pixels of an axis: a lookup table that avoids a division per corner.
template <class Index>
void tabulate(int length, const Index& index, std::vector<std::uint32_t>& of) {
  of.resize(static_cast<std::size_t>(std::max(length, 0)));
  for (int i = 0; i < length; ++i) of[static_cast<std::size_t>(i)] = static_cast<std::uint32_t>(index(i));
}

// Smallest number n <= max for which count(n) >= wanted, by bisection. `count` must be monotonic and count(max) >=
// wanted.
template <class Count>
std::uint32_t min_sufficient(std::uint32_t max, std::size_t wanted, const Count& count) {
  std::uint32_t low = 0, high = max;
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (count(middle) >= wanted) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

}  // namespace

void distribute_over_levels(std::span<const double> area, std::span<const std::size_t> available, std::size_t wanted,
                            std::span<std::size_t> counts) {
  BSLAM_ASSERT(area.size() == available.size() && area.size() == counts.size(),
               "all arguments must have one entry per level");
  std::fill(counts.begin(), counts.end(), 0);
  std::size_t left = wanted;
  // Each round distributes the rest over the levels that still have corners. It fills a level or is the last round.
  for (std::size_t round = 0; round <= area.size() && left > 0; ++round) {
    double open_area = 0;
    for (std::size_t l = 0; l < area.size(); ++l) open_area += counts[l] < available[l] ? area[l] : 0.0;
    if (open_area <= 0) return;
    double owed = 0;  // rounding error carried from level to level, so that the sum is correct
    const auto to_give = static_cast<double>(left);
    for (std::size_t l = 0; l < area.size(); ++l) {
      if (counts[l] >= available[l]) continue;
      owed += to_give * area[l] / open_area;
      const double whole = std::floor(owed + 0.5);
      owed -= whole;
      const std::size_t part = std::min({static_cast<std::size_t>(whole), available[l] - counts[l], left});
      counts[l] += part;
      left -= part;
    }
  }
}

Distribution::Distribution(std::size_t max_wanted) {
  taken_.reserve(max_wanted);
  cells_.reserve(max_wanted);  // sufficient unless a region is very narrow
}

void Distribution::non_maximum_suppression(std::span<const Corner> corners, const Region& region, int spacing,
                                           std::vector<std::uint32_t>& ranked) {
  // There is at most one corner per 2 x 2 block; reserves memory for any image of this size.
  const std::size_t room =
      static_cast<std::size_t>(region.width / 2 + 1) * static_cast<std::size_t>(region.height / 2 + 1);
  order_.reserve(room);
  spare_.reserve(room);
  ranked.clear();
  ranked.reserve(room);
  std::array<std::uint32_t, 257> next = score_runs(corners);
  order_.resize(corners.size());
  // In row-major order, which is kept for equal scores.
  for (std::uint32_t i = 0; i < corners.size(); ++i) order_[next[255 - corners[i].score]++] = {packed(corners[i]), i};
  const int side = std::max(1, spacing);
  const int columns = region.width / side + 3;  // one empty square on either side
  const int rows = region.height / side + 3;
  occupied_.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
  tabulate(
      region.width, [&](int x) { return x / side + 1; }, column_of_);
  tabulate(
      region.height, [&](int y) { return (y / side + 1) * columns; }, row_of_);
  for (const Entry& entry : order_) {
    const int x = x_of(entry.pixel), y = y_of(entry.pixel);
    // Two corners in one square are closer than `spacing`, so a square contains at most one selected corner.
    std::uint32_t* square = occupied_.data() + row_of_[y - region.y] + column_of_[x - region.x];
    const auto blocks = [&](std::uint32_t other) {
      const unsigned taken = other != 0;
      const unsigned near_x = std::abs(x_of(other) - x) < side, near_y = std::abs(y_of(other) - y) < side;
      return taken & near_x & near_y;
    };
    if (*square != 0) continue;
    const std::uint32_t *above = square - columns, *below = square + columns;
    // No short-circuit evaluation: eight unpredictable branches are slower than eight comparisons.
    unsigned blocked = blocks(square[-1]) | blocks(square[1]);
    for (int k = -1; k <= 1; ++k) blocked |= blocks(above[k]) | blocks(below[k]);
    if (blocked != 0) continue;
    *square = entry.pixel;
    ranked.push_back(entry.index);
  }
}

void Distribution::set_limits(std::size_t wanted) {
  const auto equal_count = static_cast<std::uint32_t>((wanted + cells_.size() - 1) / cells_.size());
  std::uint32_t most = 0;
  std::size_t eligible = 0;
  for (Cell& cell : cells_) {
    cell.limit =
        std::max(cell.strong, std::min(cell.total, equal_count));  // taken before weak ones beyond the equal number
    eligible += cell.limit;
    most = std::max(most, cell.total);
  }
  const auto sum = [&](const auto& of_cell) {
    std::size_t total = 0;
    for (const Cell& cell : cells_) total += of_cell(cell);
    return total;
  };
  if (eligible >= wanted) {
    const auto capped = [](const Cell& c, std::uint32_t n) { return std::min(c.limit, n); };
    const std::uint32_t n =
        min_sufficient(most, wanted, [&](std::uint32_t k) { return sum([&](const Cell& c) { return capped(c, k); }); });
    for (Cell& cell : cells_) {
      cell.sure = n > 0 ? capped(cell, n - 1) : 0;
      cell.limit = capped(cell, n);
    }
  } else {
    const auto filled = [](const Cell& c, std::uint32_t n) { return std::max(c.limit, std::min(c.total, n)); };
    const std::uint32_t n =
        min_sufficient(most, wanted, [&](std::uint32_t k) { return sum([&](const Cell& c) { return filled(c, k); }); });
    for (Cell& cell : cells_) {
      cell.sure = n > 0 ? filled(cell, n - 1) : cell.limit;
      cell.limit = filled(cell, n);
    }
  }
}

void Distribution::choose(std::span<const Corner> corners, std::span<const std::uint32_t> ranked, const Region& region,
                          std::size_t wanted, int strong_score, std::vector<Corner>& chosen) {
  chosen.clear();
  if (wanted == 0 || ranked.empty()) return;
  const double side = std::sqrt(region.area() * kPerCell / static_cast<double>(wanted));
  const int columns = std::max(1, static_cast<int>(std::lround(region.width / side)));
  const int rows = std::max(1, static_cast<int>(std::lround(region.height / side)));
  cells_.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), Cell{});
  tabulate(
      region.width, [&](int x) { return x * columns / region.width; }, column_of_);
  tabulate(
      region.height, [&](int y) { return y * rows / region.height * columns; }, row_of_);
  const auto cell_of = [&](const Corner& c) -> Cell& {
    return cells_[row_of_[c.y - region.y] + column_of_[c.x - region.x]];
  };
  for (const std::uint32_t i : ranked) {
    Cell& cell = cell_of(corners[i]);
    ++cell.total;
    if (corners[i].score > strong_score) ++cell.strong;
  }
  set_limits(wanted);
  taken_.clear();
  spare_.clear();
  for (const std::uint32_t i : ranked) {
    Cell& cell = cell_of(corners[i]);
    const std::uint32_t rank = cell.seen++;
    if (rank < cell.sure) {
      taken_.push_back(i);
    } else if (rank < cell.limit) {
      spare_.push_back(i);
    }
  }
  const std::size_t room = wanted - std::min(wanted, taken_.size());
  spare_.resize(std::min(room, spare_.size()));
  taken_.insert(taken_.end(), spare_.begin(), spare_.end());
  std::sort(taken_.begin(), taken_.end());  // corners are in row-major order
  for (const std::uint32_t i : taken_) chosen.push_back(corners[i]);
}

}  // namespace bslam::feature
