// Walls with doors cut out, the frames of doors, and round tours: what every built-in world is put together from.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/random.h"
#include "simulator/building.h"
#include "simulator/furniture.h"

namespace bslam::simulator {

constexpr double kHalfWall = 0.06;  // metres: half the thickness of inner walls
constexpr double kDoorHeight = 2.30, kDoorWidth = 1.30;
constexpr double kCasing = 0.09;   // width of the frame around a door
constexpr double kOverlap = 0.02;  // rectangles reach this far behind each other, so that no ray slips between them

enum class Axis { kX, kY };  // the axis an opening's wall runs along

struct Door {
  Axis along;
  double wall;    // coordinate of the wall's centre line on the other axis
  double centre;  // coordinate along the wall
};

// One inner face of a room: from `start` along `direction`, the room to its left.
struct Face {
  Vector2d start, direction;
  double length;
  Axis along;
  double wall;  // centre line of the wall it belongs to
  bool outer;   // of the world: windows go here
};

Vector2d centre_of(const Door& door);
inline Vector3d at_height(const Vector2d& p, double z) { return {p.x(), p.y(), z}; }

// South, east, north and west face of a room, whose walls' centre lines are at `low` and `high`.
std::array<Face, 4> faces_of(const Room& room, const Vector2d& low, const Vector2d& high);

// The face with its doors, of those given, cut out; returns the stretches without doors.
std::vector<WallStretch> add_face(Building& building, const Face& face, std::span<const Door> doors, double height,
                                  const Texture& texture);

// Jambs, lintel, threshold and the casing on both sides.
void add_door(Building& building, const Door& door, Random& random);

// The closed polygon with its corners rounded by arcs of `radius`, as points about `step` apart; starts half way along
// the first edge.
std::vector<Vector2d> rounded_loop(const std::vector<Vector2d>& corners, double radius, double step);

}  // namespace bslam::simulator
