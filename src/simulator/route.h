// Routes through the streets of the town.
#pragma once

#include "simulator/closed_path.h"
#include "simulator/street_grid.h"

namespace bslam::simulator {

constexpr double kShortestRoute = 200.0, kLongestRoute = 100'000.0;  // metres

// Returns a closed route of about `length` metres (within a few per cent), on the right side of the streets. It is
// made of loops around blocks: each loop begins and ends with the same piece of a street, which is thus driven again in
// the same direction.
ClosedPath make_route(const StreetGrid& grid, double length, std::uint64_t seed);

}  // namespace bslam::simulator
