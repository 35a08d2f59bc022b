#include "simulator/building.h"

#include <array>

#include "base/assert.h"
#include "base/random.h"
#include "simulator/furniture.h"
#include "simulator/outdoor.h"
#include "simulator/repeated_world.h"
#include "simulator/walls.h"

namespace bslam::simulator {
namespace {

struct RoomPlan {
  const char* name;
  double x0, y0, x1, y1, height;
  Material walls, accent, floor;
  float wall_shade, floor_shade;
};

constexpr double kEast = 20.0, kMiddle = 7.0, kNorth = 14.0;

constexpr std::array kRooms = {
    RoomPlan{"living", 0, 0, 8, kMiddle, 2.75, Material::kWallpaper, Material::kBrick, Material::kPlanks, 0.52f, 0.40f},
    RoomPlan{"kitchen", 8, 0, 12, kMiddle, 2.65, Material::kTile, Material::kPlaster, Material::kTile, 0.60f, 0.45f},
    RoomPlan{"office", 12, 0, kEast, kMiddle, 2.85, Material::kPlaster, Material::kWallpaper, Material::kCarpet, 0.58f,
             0.36f},
    RoomPlan{"bedroom", 0, kMiddle, 7.5, kNorth, 2.70, Material::kWallpaper, Material::kPlaster, Material::kPlanks,
             0.56f, 0.44f},
    RoomPlan{"library", 7.5, kMiddle, 11.5, kNorth, 2.80, Material::kPlaster, Material::kWallpaper, Material::kCarpet,
             0.50f, 0.38f},
    RoomPlan{"workshop", 11.5, kMiddle, 16, kNorth, 3.00, Material::kBrick, Material::kPlaster, Material::kTile, 0.50f,
             0.42f},
    RoomPlan{"store", 16, kMiddle, kEast, kNorth, 2.70, Material::kBrick, Material::kBrick, Material::kPlaster, 0.45f,
             0.40f},
};

constexpr std::array kDoors =
    {
        Door{Axis::kY, 8.0, 4.6},   Door{Axis::kY, 12.0, 4.6}, Door{Axis::kX, kMiddle, 14.0},
        Door{Axis::kY, 11.5, 9.1},  Door{Axis::kY, 7.5, 9.1},  Door{Axis::kX, kMiddle, 5.5},
        Door{Axis::kY, 16.0, 11.2},  // to the store room, which the tour does not visit
};

void add_room(Building& b, const RoomPlan& p, Random& random) {
  const auto inset = [](double at, double outer) { return at == 0 || at == outer ? 0.0 : kHalfWall; };
  const Room room{p.name,
                  {p.x0 + inset(p.x0, kEast), p.y0 + inset(p.y0, kNorth)},
                  {p.x1 - inset(p.x1, kEast), p.y1 - inset(p.y1, kNorth)},
                  p.height};
  b.rooms.push_back(room);
  const auto seed = [&] { return static_cast<std::uint32_t>(random.next()); };
  const Vector2d size = room.high - room.low + Vector2d::Constant(2 * kOverlap),
                 low = room.low - Vector2d::Constant(kOverlap);
  b.surfaces.push_back({at_height(low, 0), {size.x(), 0, 0}, {0, size.y(), 0}, {p.floor, seed(), p.floor_shade}});
  b.surfaces.push_back(
      {at_height(low, p.height), {0, size.y(), 0}, {size.x(), 0, 0}, {Material::kCeiling, seed(), 0.68f}});
  std::vector<WallSegment> segments;
  const std::uint32_t accent = random.below(4);
  std::uint32_t index = 0;
  for (const Face& f : faces_of(room, {p.x0, p.y0}, {p.x1, p.y1})) {
    const Texture texture{index == accent ? p.accent : p.walls, seed(), p.wall_shade};
    const std::vector<WallSegment> more = add_face(b, f, kDoors, p.height, texture);
    segments.insert(segments.end(), more.begin(), more.end());
    ++index;
  }
  std::vector<Vector2d> doors;
  for (const Door& d : kDoors) doors.push_back(centre_of(d));
  furnish(b, room, segments, doors, random);
}

}  // namespace

Building make_building(std::uint64_t seed) {
  Building b;
  constexpr double kCornerRadius =
      1.6;  // metres; at walking pace the yaw rate in corners stays below 60 degrees per second
  b.tour = rounded_loop({{5.5, 4.6}, {14.0, 4.6}, {14.0, 9.1}, {5.5, 9.1}}, kCornerRadius, Building::kTourStep);
  for (std::size_t i = 0; i < kRooms.size(); ++i) {
    Random random(seed, "room", i);
    add_room(b, kRooms[i], random);
  }
  for (std::size_t i = 0; i < kDoors.size(); ++i) {
    Random random(seed, "door", i);
    add_door(b, kDoors[i], random);
  }
  return b;
}

Building make_building(WorldKind kind, std::uint64_t seed) {
  BSLAM_ASSERT(kind != WorldKind::kTown, "the town is made in parts");
  switch (kind) {
    case WorldKind::kCorridor:
      return make_corridor(seed);
    case WorldKind::kTwinRooms:
      return make_twin_rooms(seed);
    case WorldKind::kOutdoor:
      return make_outdoor(seed);
    case WorldKind::kTown:
    case WorldKind::kBuilding:
      break;
  }
  return make_building(seed);
}

}  // namespace bslam::simulator
