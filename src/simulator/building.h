// The built-in world: one floor of a building, 20 m x 14 m, seven furnished rooms joined by doors, with a closed tour
// through six of them. World frame: x east, y north, z up, the floor at z = 0.
#pragma once

#include <string>
#include <vector>

#include "simulator/surface.h"
#include "synthetic/sway.h"

namespace bslam::simulator {

struct Lamp {
  Vector3d position;
  double intensity;  // irradiance at 1 m facing it; 1 is about a well lit white wall
};

// Inner extent of a room, metres.
struct Room {
  std::string name;
  Vector2d low, high;
  double height;
};

struct Building {
  std::vector<Room> rooms;
  std::vector<Surface> surfaces;
  std::vector<Lamp> lamps;
  // The closed tour in the plane: points kTourStep apart, the last one a step before the first. Walls and furniture
  // stay kTourClearance away from every point at most kTourSway beside it and at a height in [kTourLow, kTourHigh].
  std::vector<Vector2d> tour;

  static constexpr double kTourStep = 0.05, kTourClearance = 0.35, kTourSway = synthetic::kMaxSway, kTourLow = 1.1,
                          kTourHigh = 1.85;  // m
};

// Rooms, doors and tour are the same for every seed; materials, furniture and pictures follow from it.
Building make_building(std::uint64_t seed);

// The worlds there are: this building, and those of simulation/repeated_world.h.
enum class WorldKind { kBuilding, kCorridor, kTwinRooms };
Building make_building(WorldKind kind, std::uint64_t seed);

}  // namespace bslam::simulator
