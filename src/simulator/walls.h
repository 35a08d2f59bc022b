// Walls with openings for doors, door frames, and tours with rounded corners; used by all built-in worlds.
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
constexpr double kOverlap = 0.02;  // metres by which adjacent rectangles overlap, so that no ray passes between them

enum class Axis { kX, kY };  // the axis parallel to the wall that contains an opening

struct Door {
  Axis along;
  double wall;    // coordinate of the centre line of the wall on the other axis
  double centre;  // coordinate along the wall
};

// One inner face of a room: from `start` along `direction`, with the room on its left.
struct Face {
  Vector2d start, direction;
  double length;
  Axis along;
  double wall;  // centre line of its wall
  bool outer;   // an outer wall of the world, which may have windows
};

Vector2d centre_of(const Door& door);
inline Vector3d at_height(const Vector2d& p, double z) { return {p.x(), p.y(), z}; }

// A material of mean albedo `shade` with a random seed.
Texture texture(Material material, float shade, Random& random);

// Returns the south, east, north and west face of a room. The centre lines of its walls are at `low` and `high`.
std::array<Face, 4> faces_of(const Room& room, const Vector2d& low, const Vector2d& high);

// Adds a face with openings for the elements of `doors` that are in it. Returns the sections of wall between them.
std::vector<WallSegment> add_face(Building& building, const Face& face, std::span<const Door> doors, double height,
                                  const Texture& texture);

// Adds jambs, lintel, threshold and the casing on both sides.
void add_door(Building& building, const Door& door, Random& random);

// Returns a closed polygon with corners rounded by arcs of `radius`, as points with a spacing of about `step`. It
// starts in the middle of the first edge.
std::vector<Vector2d> rounded_loop(const std::vector<Vector2d>& corners, double radius, double step);

}  // namespace bslam::simulator
