// The town of `bslam simulate --world town`: about 1 km x 1 km of streets, houses, halls and parks. Every block, piece
// of street and crossing has its own seed, so that it is the same whichever part of the town is made.
#pragma once

#include <vector>

#include "simulator/building.h"
#include "simulator/street_grid.h"

namespace bslam::simulator {

// Distances from a path in metres up to which a part of the town is complete, and up to which it has its houses.
// Farther blocks are single boxes.
struct TownDetail {
  double complete = 110.0;
  double houses = 250.0;
  bool background = true;  // with farther blocks, sky and hills
};

// Returns the town as seen from `path`, which is not empty and becomes the tour. Its surfaces are those near the path.
Building make_town(const StreetGrid& grid, std::uint64_t seed, std::vector<Vector2d> path,
                   const TownDetail& detail = {});

}  // namespace bslam::simulator
