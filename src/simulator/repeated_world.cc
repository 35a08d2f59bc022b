#include "simulator/repeated_world.h"

#include "base/random.h"
#include "simulator/furniture.h"
#include "simulator/walls.h"

namespace bslam::simulator {
namespace {

constexpr double kHeight = 2.70;  // metres; height of all rooms

enum class Turn { kNone, kHalf };  // rotation about the z axis through the origin

// Adds the surfaces and lamps of `part`, rotated and then translated by `shift`.
void add_copy(const Building& part, Turn turn, const Vector2d& shift, Building& to) {
  const double sign = turn == Turn::kHalf ? -1.0 : 1.0;
  const auto rotated = [&](const Vector3d& v) { return Vector3d(sign * v.x(), sign * v.y(), v.z()); };
  const Vector3d by = at_height(shift, 0);
  for (Surface s : part.surfaces) {
    s.origin = rotated(s.origin) + by;
    s.u = rotated(s.u);
    s.v = rotated(s.v);
    to.surfaces.push_back(s);
  }
  for (const Lamp& lamp : part.lamps) to.lamps.push_back({rotated(lamp.position) + by, lamp.intensity});
}

void add_floor_and_ceiling(Building& b, const Vector2d& low, const Vector2d& size, Material floor, Random& random) {
  b.surfaces.push_back({at_height(low, 0), {size.x(), 0, 0}, {0, size.y(), 0}, texture(floor, 0.40f, random)});
  b.surfaces.push_back(
      {at_height(low, kHeight), {0, size.y(), 0}, {size.x(), 0, 0}, texture(Material::kCeiling, 0.68f, random)});
}

// Adds a wall from `start` along `direction`. Adjacent walls share their edges and do not overlap.
void add_wall(Building& b, const Vector2d& start, const Vector2d& direction, double length, const Texture& look) {
  b.surfaces.push_back(
      {at_height(start + length * direction, 0), at_height(-length * direction, 0), Vector3d(0, 0, kHeight), look});
}

constexpr double kWidth = 5.0, kLane = 1.1,
                 kTurnDistance =
                     1.5;  // metres: size of the corridor; distances of the tour from the middle and the ends
constexpr int kPieces = 6;

// A closed door in the wall y = `wall`, seen from the north.
void add_closed_door(Building& b, double centre, double wall, Random& random) {
  constexpr double kLeaf = 0.90, kTop = 2.05, kThickness = 0.03;  // metres
  const Texture leaf = texture(Material::kWood, 0.55f, random), casing = texture(Material::kWood, 0.25f, random);
  const double y = wall + 0.5 * kThickness;
  add_box(b.surfaces, {{centre, y, 0}, {kLeaf, kThickness, kTop}}, leaf, leaf);
  for (const double side : {-0.5, 0.5}) {
    add_box(b.surfaces, {{centre + side * (kLeaf + kCasing), y, 0}, {kCasing, 2 * kThickness, kTop}}, casing, casing);
  }
  add_box(b.surfaces, {{centre, y, kTop}, {kLeaf + 2 * kCasing, 2 * kThickness, kCasing}}, casing, casing);
}

// One segment of the corridor from its south wall to the middle, starting at x = 0.
Building corridor_side(Random& random) {
  constexpr double kWall = -0.5 * kWidth, kPeriod = kCorridorPeriod, kDoor = 0.5 * kPeriod;
  Building b;
  const Room room{"side", {0, kWall}, {kPeriod, 0}, kHeight};
  add_floor_and_ceiling(b, room.low, room.high - room.low, Material::kTile, random);
  add_wall(b, room.low, {1, 0}, kPeriod, texture(Material::kPlaster, 0.58f, random));
  add_closed_door(b, kDoor, kWall, random);
  for (double x = 0; x <= kPeriod;
       x += Building::kTourStep) {  // the path in either direction and the middle must stay free
    b.tour.emplace_back(x, -kLane);
    b.tour.emplace_back(x, 0);
  }
  constexpr double kCasingEnd = 0.54;  // metres from the middle of the door to the end of its casing
  furnish(
      b, room,
      {{room.low, {1, 0}, kDoor - kCasingEnd, false}, {{kDoor + kCasingEnd, kWall}, {1, 0}, kDoor - kCasingEnd, false}},
      {{kDoor, kWall}}, random);
  return b;
}

// The wall at x = 0 and the pictures on it.
Building corridor_end(const std::vector<Vector2d>& tour, Random& random) {
  Building b;
  b.tour = tour;
  const Vector2d start(0, 0.5 * kWidth);
  add_wall(b, start, {0, -1}, kWidth, texture(Material::kWallpaper, 0.52f, random));
  furnish(b, {"end", {0, -1.6}, {0.9, 1.6}, kHeight}, {{{0, 1.6}, {0, -1}, 3.2, false}}, {}, random);
  return b;
}

constexpr double kSide = 6.5, kHalfPassage = 2.0, kPassageWidth = 2.6;  // metres: of the twin rooms

Room first_twin() {
  return {"first", {-kHalfPassage - kSide, -0.5 * kSide}, {-kHalfPassage - kHalfWall, 0.5 * kSide}, kHeight};
}

// Walls, floor, ceiling and furniture of a room. The centre lines of its walls are at `low` and `high`.
void add_room(Building& b, const Room& room, const Vector2d& low, const Vector2d& high, std::span<const Door> doors,
              Random& random) {
  const Vector2d overlap = Vector2d::Constant(kOverlap);
  add_floor_and_ceiling(b, room.low - overlap, room.high - room.low + 2 * overlap, Material::kPlanks, random);
  std::vector<WallSegment> segments;
  for (const Face& f : faces_of(room, low, high)) {
    const auto more = add_face(b, f, doors, room.height, texture(Material::kWallpaper, 0.54f, random));
    segments.insert(segments.end(), more.begin(), more.end());
  }
  std::vector<Vector2d> centres;
  for (const Door& d : doors) centres.push_back(centre_of(d));
  furnish(b, room, segments, centres, random);
}

}  // namespace

Building make_corridor(std::uint64_t seed) {
  constexpr double kLength = kPieces * kCorridorPeriod;
  Building b;
  b.tour = rounded_loop({{kTurnDistance, -kLane},
                         {kLength - kTurnDistance, -kLane},
                         {kLength - kTurnDistance, kLane},
                         {kTurnDistance, kLane}},
                        kLane, Building::kTourStep);
  b.rooms.push_back({"corridor", {0, -0.5 * kWidth}, {kLength, 0.5 * kWidth}, kHeight});
  Random random(seed, "corridor");
  const Building side = corridor_side(random), end = corridor_end(b.tour, random);
  for (int i = 0; i < kPieces; ++i) {
    add_copy(side, Turn::kNone, {i * kCorridorPeriod, 0}, b);
    add_copy(side, Turn::kHalf, {(i + 1) * kCorridorPeriod, 0}, b);
  }
  add_copy(end, Turn::kNone, {0, 0}, b);
  add_copy(end, Turn::kHalf, {kLength, 0}, b);
  return b;
}

Building make_twin_rooms(std::uint64_t seed) {
  constexpr double kLaneOffset = 0.1;  // metres between the middle of the passage and the path in either direction
  const std::vector<Vector2d> corners = {
      {-3.6, -kLaneOffset}, {3.6, -kLaneOffset}, {5.2, -1.7}, {6.9, 0},  {5.2, 1.7},
      {3.6, kLaneOffset},   {-3.6, kLaneOffset}, {-5.2, 1.7}, {-6.9, 0}, {-5.2, -1.7}};
  Building b;
  b.tour = rounded_loop(corners, 1.15, Building::kTourStep);
  constexpr Door kWest{Axis::kY, -kHalfPassage, 0}, kEast{Axis::kY, kHalfPassage, 0};

  Building twin;
  twin.tour = b.tour;
  Random random(seed, "twin rooms");
  const Room first = first_twin();
  add_room(twin, first, first.low, {-kHalfPassage, first.high.y()}, std::array{kWest}, random);
  add_door(twin, kWest, random);
  add_copy(twin, Turn::kNone, {0, 0}, b);
  add_copy(twin, Turn::kHalf, {0, 0}, b);

  const Vector2d half(kHalfPassage, 0.5 * kPassageWidth), inner = half - Vector2d(kHalfWall, 0);
  const Room passage{"passage", -inner, inner, kHeight};
  add_room(b, passage, -half, half, std::array{kWest, kEast}, random);
  b.rooms = {first, passage, {"second", -first.high, -first.low, kHeight}};
  return b;
}

}  // namespace bslam::simulator
