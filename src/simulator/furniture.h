// Furniture, boxes, lamps and pictures for the rooms of the built-in world.
#pragma once

#include <vector>

#include "base/random.h"
#include "simulator/building.h"

namespace bslam::simulator {

// A section of wall between doors, seen from inside a room: `length` metres long, from `start` along the unit vector
// `direction`, with the room on its left (normal = z x direction).
struct WallSegment {
  Vector2d start, direction;
  double length;
  bool outer;  // an outer wall, which may have windows
};

// Furnishes one room: adds surfaces and lamps to `building`, away from its tour and from `door_centres` (in the plane).
void furnish(Building& building, const Room& room, const std::vector<WallSegment>& walls,
             const std::vector<Vector2d>& door_centres, Random& random);

}  // namespace bslam::simulator
