// The streets of the town: straight streets along both axes with different distances and widths.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "simulator/surface.h"

namespace bslam::simulator {

// One street. Its facades are at least `half_width` from its middle, and its kerbs are at half_road().
struct Street {
  double centre = 0;      // coordinate of its middle on the other axis
  double half_width = 0;  // metres

  static constexpr double kPavement = 2.3;  // metres: width of each pavement
  double half_road() const { return half_width - kPavement; }
};

struct StreetGrid {
  static constexpr std::size_t kStreets = 13;  // in each direction; the first and the last are at the edge of the town

  // Index 0: streets parallel to the y axis, ordered by x. Index 1: those parallel to the x axis, ordered by y.
  std::array<std::vector<Street>, 2> streets;

  const Street& x(std::size_t i) const { return streets[0][i]; }
  const Street& y(std::size_t j) const { return streets[1][j]; }
  Vector2d crossing(std::size_t i, std::size_t j) const { return {x(i).centre, y(j).centre}; }
};

// A rectangle with its sides along the axes, in metres.
struct Area {
  Vector2d low, high;

  Vector2d size() const { return high - low; }
  double distance(const Vector2d& point) const;  // 0 inside
};

// Returns streets of 14 m to 18 m and blocks of 40 m to 90 m, in a town of about 1 km x 1 km around the origin.
StreetGrid make_street_grid(std::uint64_t seed);

// The block between the streets i and i + 1, j and j + 1, with its pavements.
Area block_area(const StreetGrid& grid, std::size_t i, std::size_t j);

}  // namespace bslam::simulator
