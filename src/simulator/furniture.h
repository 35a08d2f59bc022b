// Furniture, boxes, lamps and pictures for the rooms of the built-in world.
#pragma once

#include <vector>

#include "base/random.h"
#include "simulator/building.h"

namespace bslam::simulator {

// A stretch of wall seen from inside a room: along `direction` (unit) from `start`, `length` metres, the room to its
// left (normal = z x direction). Doors are already cut out.
struct WallStretch {
  Vector2d start, direction;
  double length;
  bool outer;  // windows go here
};

// Fills one room: adds surfaces and lamps to `building`, clear of its tour and of `door_centres` (in the plane).
void furnish(Building& building, const Room& room, const std::vector<WallStretch>& walls,
             const std::vector<Vector2d>& door_centres, Random& random);

}  // namespace bslam::simulator
