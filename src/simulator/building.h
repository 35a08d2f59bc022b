// The built-in world: one floor of a building, 20 m x 14 m, with seven furnished rooms connected by doors, and a closed
// tour through six of them. World frame: x east, y north, z up, with the floor at z = 0.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "simulator/surface.h"
#include "synthetic/sway.h"

namespace bslam::simulator {

struct Lamp {
  Vector3d position;
  double intensity;  // irradiance of a surface facing the lamp at 1 m; a well lit white wall has about 1
};

// The sun: its light is the same everywhere.
struct Sun {
  Vector3d direction;  // unit vector towards it
  double irradiance;   // irradiance of a surface facing the sun
};

// Interior of a room, in metres.
struct Room {
  std::string name;
  Vector2d low, high;
  double height;
};

struct Building {
  std::vector<Room> rooms;
  std::vector<Surface> surfaces;
  std::vector<Lamp> lamps;
  std::optional<Sun> sun;
  // The closed tour in the plane: points with a spacing of kTourStep; the last point is one step before the first.
  // Walls and furniture keep a distance of kTourClearance from all points that are within kTourSway of the tour at a
  // height in [kTourLow, kTourHigh].
  std::vector<Vector2d> tour;

  static constexpr double kTourStep = 0.05, kTourClearance = 0.35, kTourSway = synthetic::kMaxSway, kTourLow = 1.1,
                          kTourHigh = 1.85;  // m
};

// Creates the building. The seed determines materials, furniture and pictures on the walls; rooms, doors and tour are
// the same for every seed.
Building make_building(std::uint64_t seed);

// The available worlds: this building, those of simulator/repeated_world.h, and those of simulator/outdoor.h and
// simulator/town.h.
enum class WorldKind { kBuilding, kCorridor, kTwinRooms, kOutdoor, kTown };

// Creates a world that is small enough to be made as a whole: any but the town.
Building make_building(WorldKind kind, std::uint64_t seed);

}  // namespace bslam::simulator
