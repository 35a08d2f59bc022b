#include "simulator/furniture.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bslam::simulator {
namespace {

using std::numbers::pi;

// An axis-parallel rectangle of floor.
struct Footprint {
  Vector2d low, high;

  bool overlaps(const Footprint& o, double gap) const {
    return (low.array() < o.high.array() + gap).all() && (o.low.array() < high.array() + gap).all();
  }
  double distance(const Vector2d& p) const { return (p - p.cwiseMax(low).cwiseMin(high)).norm(); }
};

// The footprint of a box with side lengths `size`, rotated by yaw.
Footprint footprint_of(const Vector2d& centre, const Vector2d& size, double yaw) {
  const double c = std::abs(std::cos(yaw)), s = std::abs(std::sin(yaw));
  const Vector2d half = 0.5 * Vector2d(c * size.x() + s * size.y(), s * size.x() + c * size.y());
  return {centre - half, centre + half};
}

// Places furniture in a room and keeps track of occupied floor.
class Furnisher {
 public:
  Furnisher(Building& building, const Room& room, const std::vector<WallSegment>& walls,
            const std::vector<Vector2d>& doors, Random& random)
      : building_(building), room_(room), walls_(walls), doors_(doors), random_(random) {}

  void furnish() {
    add_lamps();
    const double area = (room_.high - room_.low).prod();
    const int shelves = static_cast<int>(area / 8), tables = static_cast<int>(area / 14),
              boxes = static_cast<int>(area / 6);
    for (int i = 0; i < shelves; ++i) add_shelf();
    add_cupboard();
    for (int i = 0; i < tables; ++i) add_table();
    add_pillar();
    for (int i = 0; i < boxes; ++i) add_box_stack();
    add_floor_lamp();
    for (const WallSegment& wall : walls_) add_pictures(wall);
  }

 private:
  Texture texture(Material material, double shade) {
    return {material, static_cast<std::uint32_t>(random_.next()), static_cast<float>(shade)};
  }
  double shade() { return random_.uniform(0.15, 0.8); }

  // A box to add. Initialised with braces, which guarantees the order of random draws.
  struct Piece {
    Vector2d centre;
    double bottom;
    Vector3d size;
    double yaw;
    Texture sides, top;
  };

  void add(const Piece& p) {
    add_box(building_.surfaces, {{p.centre.x(), p.centre.y(), p.bottom}, p.size, p.yaw}, p.sides, p.top);
  }

  // Returns true if the floor is inside the room and away from doors, the tour and other furniture.
  bool is_free(const Footprint& f, double gap) const {
    if ((f.low.array() < room_.low.array()).any() || (f.high.array() > room_.high.array()).any()) return false;
    for (const Vector2d& door : doors_) {
      if (f.distance(door) < 0.95) return false;
    }
    for (const Vector2d& place : building_.tour) {
      if (f.distance(place) < kTourGap) return false;
    }
    return std::none_of(taken_.begin(), taken_.end(), [&](const Footprint& o) { return f.overlaps(o, gap); });
  }

  // Finds free floor for an object of this size with its back to a wall. Returns false if there is none.
  bool find_at_wall(const Vector2d& size, Vector2d& centre, double& yaw) {
    for (int trial = 0; trial < 60; ++trial) {
      const WallSegment& w = walls_[random_.below(static_cast<std::uint32_t>(walls_.size()))];
      if (w.length < size.x() + 0.1) continue;
      const Vector2d normal(-w.direction.y(), w.direction.x());
      centre = w.start + random_.uniform(0.5 * size.x() + 0.02, w.length - 0.5 * size.x() - 0.02) * w.direction +
               (0.5 * size.y() + 0.015) * normal;
      yaw = std::atan2(w.direction.y(), w.direction.x());
      if (take(footprint_of(centre, size, yaw), 0.05)) return true;
    }
    return false;
  }

  bool find_in_room(const Vector2d& size, Vector2d& centre, double& yaw) {
    for (int trial = 0; trial < 60; ++trial) {
      centre = {random_.uniform(room_.low.x(), room_.high.x()), random_.uniform(room_.low.y(), room_.high.y())};
      yaw = random_.uniform(0, pi);
      if (take(footprint_of(centre, size, yaw), 0.15)) return true;
    }
    return false;
  }

  bool take(const Footprint& f, double gap) {
    if (!is_free(f, gap)) return false;
    taken_.push_back(f);
    return true;
  }

  // Boards between two side panels, with books and small objects on them.
  void add_shelf() {
    const Vector3d size{random_.uniform(0.8, 1.5), random_.uniform(0.25, 0.36), random_.uniform(1.1, 2.1)};
    Vector2d centre;
    double yaw = 0;
    if (!find_at_wall(size.head<2>(), centre, yaw)) return;
    const Vector2d x(std::cos(yaw), std::sin(yaw)), y(-x.y(), x.x());
    const Texture wood = texture(Material::kWood, shade());
    for (const double side : {-0.5, 0.5}) {
      add({centre + side * (size.x() - 0.03) * x, 0, {0.03, size.y(), size.z()}, yaw, wood, wood});
    }
    add({centre - 0.5 * (size.y() - 0.012) * y, 0, {size.x(), 0.012, size.z()}, yaw, wood, wood});
    const double pitch = random_.uniform(0.30, 0.42);
    for (double z = 0.06; z < size.z(); z += pitch) {
      add({centre, z, {size.x() - 0.06, size.y(), 0.025}, yaw, texture(Material::kWood, wood.shade), wood});
      if (z + pitch < size.z() + 0.1) add_row(centre, x, y, yaw, size, z + 0.025, pitch - 0.05);
    }
  }

  // A row of books and boxes on a board. Books are upright or lean against the wall.
  void add_row(const Vector2d& centre, const Vector2d& x, const Vector2d& y, double yaw, const Vector3d& shelf,
               double bottom, double headroom) {
    double at = -0.5 * shelf.x() + 0.05;
    while (at < 0.5 * shelf.x() - 0.10) {
      const bool boxed = random_.uniform() < 0.12;
      const double width = boxed ? random_.uniform(0.12, 0.25) : random_.uniform(0.022, 0.065);
      const double height = headroom * random_.uniform(0.55, 0.97), depth = shelf.y() * random_.uniform(0.55, 0.85);
      if (random_.uniform() < 0.12) {
        at += random_.uniform(0.05, 0.25);
        continue;
      }
      if (at + width > 0.5 * shelf.x() - 0.04) break;
      const Texture look = texture(boxed ? Material::kCardboard : Material::kBook, random_.uniform(0.08, 0.85));
      add({centre + (at + 0.5 * width) * x + 0.5 * (depth - shelf.y() + 0.05) * y,
           bottom,
           {width, depth, height},
           yaw,
           look,
           texture(Material::kPlain, 0.7)});
      at += width + 0.002;
    }
  }

  void add_cupboard() {
    const Vector3d size{random_.uniform(1.0, 1.8), random_.uniform(0.4, 0.55), random_.uniform(0.75, 1.3)};
    Vector2d centre;
    double yaw = 0;
    if (!find_at_wall(size.head<2>(), centre, yaw)) return;
    add({centre, 0, size, yaw, texture(Material::kWood, shade()), texture(Material::kWood, shade())});
    add_clutter(centre, size.z(), 0.42 * size.head<2>(), yaw, 5);
  }

  void add_table() {
    const Vector3d size{random_.uniform(0.9, 1.7), random_.uniform(0.6, 0.9), random_.uniform(0.45, 0.78)};
    Vector2d centre;
    double yaw = 0;
    if (!find_in_room(size.head<2>(), centre, yaw)) return;
    const Vector2d x(std::cos(yaw), std::sin(yaw)), y(-x.y(), x.x());
    const Texture wood = texture(Material::kWood, shade());
    const Texture top =
        random_.uniform() < 0.4 ? texture(Material::kFabric, shade()) : texture(Material::kWood, shade());
    add({centre, size.z() - 0.04, {size.x(), size.y(), 0.04}, yaw, wood, top});
    for (const double a : {-0.45, 0.45}) {
      for (const double b : {-0.42, 0.42}) {
        add({centre + a * size.x() * x + b * size.y() * y, 0, {0.06, 0.06, size.z() - 0.04}, yaw, wood, wood});
      }
    }
    add_clutter(centre, size.z(), 0.42 * size.head<2>(), yaw, 6);
  }

  // Small boxes, piles of books and a picture frame on a surface with half extents `half` at height `bottom`.
  void add_clutter(const Vector2d& centre, double bottom, const Vector2d& half, double yaw, int count) {
    const Vector2d x(std::cos(yaw), std::sin(yaw)), y(-x.y(), x.x());
    for (int i = 0; i < count; ++i) {
      const double u = (static_cast<double>(i) + 0.5) / count * 2 - 1;
      const Vector2d place = centre + u * half.x() * x + random_.uniform(-0.5, 0.5) * half.y() * y;
      const double turn = yaw + random_.uniform(-0.6, 0.6), size = 0.8 * half.x() / count;
      double z = bottom;
      const int pile = 1 + static_cast<int>(random_.below(4));
      for (int k = 0; k < pile; ++k) {
        const Vector3d box{random_.uniform(0.8, 1.4) * size, random_.uniform(0.8, 1.6) * size,
                           random_.uniform(0.025, 0.13)};
        const Material material = k % 2 == 0 ? Material::kCardboard : Material::kFabric;
        add({place, z, box, turn + 0.2 * k, texture(material, shade()), texture(Material::kPoster, 0.5)});
        z += box.z();
      }
    }
  }

  void add_box_stack() {
    const Vector3d size{random_.uniform(0.3, 0.6), random_.uniform(0.3, 0.5), random_.uniform(0.25, 0.5)};
    Vector2d centre;
    double yaw = 0;
    const bool found = random_.uniform() < 0.5 ? find_at_wall(1.15 * size.head<2>(), centre, yaw)
                                               : find_in_room(1.15 * size.head<2>(), centre, yaw);
    if (!found) return;
    double z = 0;
    const int stack = 1 + static_cast<int>(random_.below(3));
    for (int k = 0; k < stack; ++k) {
      const double scale = std::pow(0.85, k);
      add({centre, z, scale * size, yaw + random_.uniform(-0.12, 0.12),
           texture(Material::kCardboard, random_.uniform(0.3, 0.65)),
           texture(Material::kCardboard, random_.uniform(0.3, 0.65))});
      z += scale * size.z();
    }
  }

  void add_pillar() {
    Vector2d centre;
    double yaw = 0;
    const double width = random_.uniform(0.28, 0.42);
    if ((room_.high - room_.low).prod() < 20 || !find_in_room({1.2 * width, 1.2 * width}, centre, yaw)) return;
    const Texture side =
        texture(random_.uniform() < 0.5 ? Material::kBrick : Material::kPlaster, random_.uniform(0.35, 0.65));
    add({centre, 0, {width, width, room_.height}, 0, side, side});
    add({centre,
         0,
         {width + 0.05, width + 0.05, 0.12},
         0,
         texture(Material::kWood, 0.3),
         texture(Material::kWood, 0.3)});
  }

  void add_floor_lamp() {
    Vector2d centre;
    double yaw = 0;
    if (!find_at_wall({0.36, 0.36}, centre, yaw)) return;
    const Texture metal = texture(Material::kPlain, 0.15);
    add({centre, 0, {0.28, 0.28, 0.03}, yaw, metal, metal});
    add({centre, 0.03, {0.03, 0.03, 1.35}, yaw, metal, metal});
    add({centre, 1.38, {0.30, 0.30, 0.32}, yaw, texture(Material::kFabric, 0.8), texture(Material::kLamp, 0.9)});
    building_.lamps.push_back({{centre.x(), centre.y(), 1.9}, 0.35});
  }

  // Hanging lamps on a coarse grid.
  void add_lamps() {
    const Vector2d size = room_.high - room_.low;
    const int columns = std::max(1, static_cast<int>(std::lround(size.x() / 3.4)));
    const int rows = std::max(1, static_cast<int>(std::lround(size.y() / 3.6)));
    for (int c = 0; c < columns; ++c) {
      for (int r = 0; r < rows; ++r) {
        const Vector2d at = room_.low + Vector2d{(c + random_.uniform(0.4, 0.6)) / columns * size.x(),
                                                 (r + random_.uniform(0.4, 0.6)) / rows * size.y()};
        const double bottom = room_.height - random_.uniform(0.22, 0.34), yaw = random_.uniform(0, pi);
        add({at,
             bottom + 0.1,
             {0.02, 0.02, room_.height - bottom - 0.1},
             yaw,
             texture(Material::kPlain, 0.1),
             texture(Material::kPlain, 0.1)});
        add({at, bottom, {0.3, 0.3, 0.10}, yaw, texture(Material::kLamp, 0.9), texture(Material::kPlain, 0.2)});
        building_.lamps.push_back({{at.x(), at.y(), bottom - 0.06}, random_.uniform(0.9, 1.2)});
      }
    }
  }

  // Pictures, posters and windows side by side along a section of wall.
  void add_pictures(const WallSegment& wall) {
    const Vector2d normal(-wall.direction.y(), wall.direction.x());
    const double yaw = std::atan2(wall.direction.y(), wall.direction.x());
    for (double at = 0.15 + random_.uniform(0, 0.4); at < wall.length - 0.4;) {
      const bool large = random_.uniform() < 0.3;
      const double width = large ? random_.uniform(0.9, 1.4) : random_.uniform(0.3, 0.8);
      const double height = large ? random_.uniform(0.8, 1.2) : width * random_.uniform(0.7, 1.4);
      if (at + width > wall.length - 0.12) {
        at += 0.3;
        continue;
      }
      const double top = std::min(room_.height - 0.2, random_.uniform(1.75, 2.35));
      const Vector2d centre = wall.start + (at + 0.5 * width) * wall.direction + 0.012 * normal;
      const Texture look = texture(large && wall.outer ? Material::kWindow : Material::kPoster, 0.5);
      Texture face = look;
      face.seed += 1;
      add_picture(centre, normal, yaw, {width, 0.02, height}, std::max(0.6, top - height), face);
      at += width + random_.uniform(0.15, 0.9);
    }
  }

  void add_picture(const Vector2d& centre, const Vector2d& normal, double yaw, const Vector3d& size, double bottom,
                   const Texture& face) {
    const Texture frame = texture(Material::kPlain, 0.3);
    add({centre, bottom, size, yaw, frame, frame});
    const Vector2d x(std::cos(yaw), std::sin(yaw));
    const Vector2d corner = centre + 0.5 * size.x() * x + (0.5 * size.y() + 0.002) * normal, edge = -size.x() * x;
    building_.surfaces.push_back({{corner.x(), corner.y(), bottom}, {edge.x(), edge.y(), 0}, {0, 0, size.z()}, face});
  }

  // Distance in metres between the tour and furniture: clearance, sway and a margin for the step of the tour.
  static constexpr double kTourGap = Building::kTourClearance + Building::kTourSway + 0.1;

  Building& building_;
  const Room& room_;
  const std::vector<WallSegment>& walls_;
  const std::vector<Vector2d>& doors_;
  Random& random_;
  std::vector<Footprint> taken_;
};

}  // namespace

void furnish(Building& building, const Room& room, const std::vector<WallSegment>& walls,
             const std::vector<Vector2d>& door_centres, Random& random) {
  // Copied, since adding to the building may reallocate its rooms.
  const Room here = room;
  Furnisher(building, here, walls, door_centres, random).furnish();
}

}  // namespace bslam::simulator
