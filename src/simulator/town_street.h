// Streets and crossings of the town: roads with markings, parked vehicles, trees and street furniture.
#pragma once

#include <vector>

#include "simulator/street_grid.h"
#include "simulator/town_block.h"

namespace bslam::simulator {

// A street between two crossings.
struct StreetPiece {
  std::size_t axis = 0;              // direction of the street: 0: x, 1: y
  Vector2d start, along;             // a point in the middle of the road; unit vector along it
  double length = 0, half_road = 0;  // metres

  Vector2d at(double along_m, double left_m) const { return start + along_m * along + left_m * left_of(along); }
  Area area() const;
};

// The pieces of street that begin at a crossing, towards x and y; none at the end of a street.
std::vector<StreetPiece> pieces_from(const StreetGrid& grid, std::size_t i, std::size_t j);

Area crossing_area(const StreetGrid& grid, std::size_t i, std::size_t j);

void add_street(Building& building, const StreetPiece& piece, const PartSeed& seed, Detail detail);
void add_crossing(Building& building, const Area& area, const PartSeed& seed, Detail detail);

}  // namespace bslam::simulator
