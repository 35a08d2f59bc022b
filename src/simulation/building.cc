#include "simulation/building.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/random.h"
#include "simulation/furniture.h"

namespace bslam::simulation {
namespace {

constexpr double kHalfWall = 0.06;  // metres: half the thickness of inner walls
constexpr double kDoorHeight = 2.30, kDoorWidth = 1.30;
constexpr double kCasing = 0.09;   // width of the frame around a door
constexpr double kOverlap = 0.02;  // rectangles reach this far behind each other, so that no ray slips between them

enum class Axis { kX, kY };  // the axis an opening's wall runs along

struct Door {
  Axis along;
  double wall;    // coordinate of the wall on the other axis
  double centre;  // coordinate along the wall
};

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

constexpr std::array kDoors = {
    Door{Axis::kY, 8.0, 4.6}, Door{Axis::kY, 12.0, 4.6},    Door{Axis::kX, kMiddle, 14.0}, Door{Axis::kY, 11.5, 9.1},
    Door{Axis::kY, 7.5, 9.1}, Door{Axis::kX, kMiddle, 5.5}, Door{Axis::kY, 16.0, 11.2},  // to the store, off the tour
};

// One inner face of a room: from `start` along `direction`, the room to its left.
struct Face {
  Vector2d start, direction;
  double length;
  Axis along;
  double wall;  // centre line of the wall it belongs to
};

std::array<Face, 4> faces_of(const RoomPlan& p, const Room& r) {
  return {Face{r.low, {1, 0}, r.high.x() - r.low.x(), Axis::kX, p.y0},
          Face{{r.high.x(), r.low.y()}, {0, 1}, r.high.y() - r.low.y(), Axis::kY, p.x1},
          Face{r.high, {-1, 0}, r.high.x() - r.low.x(), Axis::kX, p.y1},
          Face{{r.low.x(), r.high.y()}, {0, -1}, r.high.y() - r.low.y(), Axis::kY, p.x0}};
}

Vector2d centre_of(const Door& d) {
  return d.along == Axis::kX ? Vector2d(d.centre, d.wall) : Vector2d(d.wall, d.centre);
}

Vector3d at_height(const Vector2d& p, double z) { return {p.x(), p.y(), z}; }

// A rectangle of a face between two places along it and two heights.
void add_wall_piece(Building& b, const Face& f, double from, double to, double low, double high,
                    const Texture& texture) {
  b.surfaces.push_back({at_height(f.start + to * f.direction, low), at_height((from - to) * f.direction, 0),
                        Vector3d(0, 0, high - low), texture, Vector2d(-to, low)});
}

bool is_outer(const Face& f) { return f.wall == 0 || f.wall == (f.along == Axis::kX ? kNorth : kEast); }

// The face with its doors cut out; returns the stretches without doors.
std::vector<WallStretch> add_face(Building& b, const Face& f, double height, const Texture& texture) {
  std::vector<double> doors;  // distances along the face
  for (const Door& d : kDoors) {
    const double at = (centre_of(d) - f.start).dot(f.direction);
    if (d.along == f.along && d.wall == f.wall && at > 0 && at < f.length) doors.push_back(at);
  }
  std::sort(doors.begin(), doors.end());
  std::vector<WallStretch> stretches;
  double from = 0;
  const auto close = [&](double to, double left_overlap, double right_overlap) {
    add_wall_piece(b, f, from - left_overlap, to + right_overlap, -kOverlap, height + kOverlap, texture);
    stretches.push_back({f.start + from * f.direction, f.direction, to - from, is_outer(f)});
  };
  for (const double at : doors) {
    close(at - 0.5 * kDoorWidth, from == 0 ? kOverlap : 0, 0);
    from = at + 0.5 * kDoorWidth;
    add_wall_piece(b, f, at - 0.5 * kDoorWidth, from, kDoorHeight, height + kOverlap, texture);
  }
  close(f.length, from == 0 ? kOverlap : 0, kOverlap);
  return stretches;
}

// Jambs, lintel, threshold and the casing on both sides.
void add_door(Building& b, const Door& d, Random& random) {
  const Texture wood{Material::kWood, static_cast<std::uint32_t>(random.next()), random.uniform() < 0.5 ? 0.25f : 0.7f};
  const Vector2d along = d.along == Axis::kX ? Vector2d(1, 0) : Vector2d(0, 1);
  const Vector2d across(-along.y(), along.x()), c = centre_of(d);
  const double half = 0.5 * kDoorWidth, depth = kHalfWall + kOverlap;
  for (const double side : {-1.0, 1.0}) {
    Texture jamb = wood;
    jamb.seed += side > 0 ? 1 : 2;
    const Vector2d inwards = -side * across;  // edge whose normal looks into the opening
    b.surfaces.push_back({at_height(c + side * half * along - depth * inwards, -kOverlap),
                          at_height(2 * depth * inwards, 0), Vector3d(0, 0, kDoorHeight + 2 * kOverlap), jamb});
    const Vector2d post = c + side * (half + 0.5 * kCasing) * along;
    const double yaw = std::atan2(along.y(), along.x());
    for (const double face : {-1.0, 1.0}) {
      const Vector2d beside = face * (kHalfWall + 0.01) * across;
      add_box(b.surfaces, {at_height(post + beside, 0), {kCasing, 0.02, kDoorHeight + kCasing}, yaw}, jamb, jamb);
      if (side > 0)
        add_box(b.surfaces, {at_height(c + beside, kDoorHeight), {kDoorWidth, 0.02, kCasing}, yaw}, wood, wood);
    }
  }
  const Vector3d corner = at_height(c - half * along - depth * across, kDoorHeight);
  b.surfaces.push_back({corner, at_height(2 * depth * across, 0), at_height(2 * half * along, 0), wood});
  b.surfaces.push_back({corner - Vector3d(0, 0, kDoorHeight - 0.002), at_height(2 * half * along, 0),
                        at_height(2 * depth * across, 0), wood});
}

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
  std::vector<WallStretch> stretches;
  const std::uint32_t accent = random.below(4);
  std::uint32_t index = 0;
  for (const Face& f : faces_of(p, room)) {
    const Texture texture{index == accent ? p.accent : p.walls, seed(), p.wall_shade};
    const std::vector<WallStretch> more = add_face(b, f, p.height, texture);
    stretches.insert(stretches.end(), more.begin(), more.end());
    ++index;
  }
  std::vector<Vector2d> doors;
  for (const Door& d : kDoors) doors.push_back(centre_of(d));
  furnish(b, room, stretches, doors, random);
}

// The closed polygon with its corners rounded by arcs of `radius`, as points about `step` apart; starts half way along
// the first edge.
std::vector<Vector2d> rounded_loop(const std::vector<Vector2d>& corners, double radius, double step) {
  std::vector<Vector2d> fine;
  const std::size_t n = corners.size();
  const auto line = [&](const Vector2d& from, const Vector2d& to) {
    const int count = std::max(1, static_cast<int>((to - from).norm() / step));
    for (int i = 0; i < count; ++i) fine.push_back(from + (to - from) * i / count);
  };
  Vector2d last = 0.5 * (corners[0] + corners[1]);
  const Vector2d first = last;
  for (std::size_t k = 1; k <= n; ++k) {
    const Vector2d& corner = corners[k % n];
    const Vector2d in = (corner - corners[k - 1]).normalized(), out = (corners[(k + 1) % n] - corner).normalized();
    const double turn = std::atan2(in.x() * out.y() - in.y() * out.x(), in.dot(out));
    const double reach = radius * std::tan(0.5 * std::abs(turn)), side = turn > 0 ? 1.0 : -1.0;
    const Vector2d begin = corner - reach * in, centre = begin + side * radius * Vector2d(-in.y(), in.x());
    line(last, begin);
    const int count = std::max(1, static_cast<int>(radius * std::abs(turn) / step));
    for (int i = 0; i < count; ++i) fine.push_back(centre + Eigen::Rotation2Dd(turn * i / count) * (begin - centre));
    last = corner + reach * out;
  }
  line(last, first);
  return fine;
}

}  // namespace

Building make_building(std::uint64_t seed) {
  Building b;
  constexpr double kCornerRadius = 1.6;  // metres: turns at walking pace stay below 60 degrees a second
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

}  // namespace bslam::simulation
