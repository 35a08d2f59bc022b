#include "simulator/street_grid.h"

#include <algorithm>

#include "base/random.h"

namespace bslam::simulator {

double Area::distance(const Vector2d& point) const {
  const Vector2d outside = (low - point).cwiseMax(point - high).cwiseMax(0.0);
  return outside.norm();
}

StreetGrid make_street_grid(std::uint64_t seed) {
  constexpr std::size_t kSmall = StreetGrid::kStreets / 2 - 1;  // a small block in the middle, for short drives
  constexpr double kNarrow = 7.0, kShort = 40.0;                // metres
  Random random(seed, "streets");
  StreetGrid grid;
  for (std::vector<Street>& streets : grid.streets) {
    double at = 0;
    for (std::size_t i = 0; i < StreetGrid::kStreets; ++i) {
      const bool narrow = i == kSmall || i == kSmall + 1;
      const double half = random.uniform(7.0, 9.0), block = random.uniform(40.0, 90.0);
      const Street street{at + (narrow ? kNarrow : half), narrow ? kNarrow : half};
      streets.push_back(street);
      at = street.centre + street.half_width + (i == kSmall ? kShort : block);
    }
    const double middle = 0.5 * (streets.front().centre + streets.back().centre);
    for (Street& street : streets) street.centre -= middle;
  }
  return grid;
}

Area block_area(const StreetGrid& grid, std::size_t i, std::size_t j) {
  const Street &west = grid.x(i), &east = grid.x(i + 1), &south = grid.y(j), &north = grid.y(j + 1);
  return {{west.centre + west.half_road(), south.centre + south.half_road()},
          {east.centre - east.half_road(), north.centre - north.half_road()}};
}

}  // namespace bslam::simulator
