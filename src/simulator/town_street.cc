#include "simulator/town_street.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bslam::simulator {
namespace {

constexpr double kPatch = 0.002, kLid = 0.003, kPaint = 0.004;  // metres above the road
constexpr double kCoarseTexel = 0.25;
constexpr double kFreeEnd = 7.0;  // metres at both ends of a piece without vehicles and trees

// The same asphalt everywhere in town: its pattern never repeats.
Texture road(std::uint64_t town) {
  Random random(town, "road");
  return texture(Material::kAsphalt, 0.22f, random);
}

Area area_between(const Vector2d& a, const Vector2d& b) { return {a.cwiseMin(b), a.cwiseMax(b)}; }

// A rectangle on the road between two positions along a piece and across it.
void add_mark(Building& b, const StreetPiece& p, const Vector2d& from, const Vector2d& to, double z,
              const Texture& look) {
  add_flat(b, area_between(p.at(from.x(), from.y()), p.at(to.x(), to.y())), z, look);
}

void add_zebra(Building& b, const StreetPiece& p, double at, const Texture& paint) {
  for (double left = -p.half_road + 0.4; left + 0.5 < p.half_road; left += 1.0)
    add_mark(b, p, {at, left}, {at + 3.0, left + 0.5}, kPaint, paint);
}

void add_markings(Building& b, const StreetPiece& p, Random& random) {
  const Texture paint = texture(Material::kPlaster, 0.72f, random);
  for (double at = 6; at + 3 < p.length - 5; at += 6) add_mark(b, p, {at, -0.06}, {at + 3, 0.06}, kPaint, paint);
  if (random.below(3) != 0) add_zebra(b, p, 0.8, paint);
  if (random.below(3) != 0) add_zebra(b, p, p.length - 3.8, paint);
  for (int i = 0; i < static_cast<int>(p.length / 9); ++i) {
    const Vector2d at{random.uniform(5, p.length - 8), random.uniform(-p.half_road + 0.2, p.half_road - 2.2)};
    const Vector2d size{random.uniform(0.6, 3.0), random.uniform(0.5, 2.0)};
    const Texture look = texture(Material::kAsphalt, static_cast<float>(random.uniform(0.13, 0.32)), random);
    add_mark(b, p, at, at + size, kPatch, look);
  }
  for (int i = 0; i < 4; ++i) {
    const Vector2d at{random.uniform(5, p.length - 6), random.uniform(-p.half_road + 0.3, p.half_road - 1.0)};
    add_mark(b, p, at, at + Vector2d(0.65, 0.65), kLid, texture(Material::kTile, 0.16f, random));
  }
}

// A parked vehicle: its middle, and the direction of its length.
void add_car(Building& b, const Vector2d& place, const Vector2d& along, Random& random) {
  const double yaw = std::atan2(along.y(), along.x()), length = random.uniform(3.7, 4.7),
               width = random.uniform(1.62, 1.8);
  const bool van = random.below(5) == 0;
  const double body = van ? 1.2 : 0.58, cabin = van ? 0.55 : 0.56;
  const auto at = [&](double ahead, double left, double z) {
    return at_height(place + ahead * along + left * left_of(along), z);
  };
  const Texture paint = texture(Material::kPlain, static_cast<float>(random.uniform(0.08, 0.75)), random),
                glass = texture(Material::kPlain, 0.07f, random), tyre = texture(Material::kPlain, 0.05f, random),
                lamp = texture(Material::kPlain, 0.85f, random), plate = texture(Material::kPoster, 0.6f, random);
  for (const double axle : {-0.3, 0.3})
    add_box(b.surfaces, {at(axle * length, 0, 0), {0.6, width + 0.02, 0.6}, yaw}, tyre, tyre);
  add_box(b.surfaces, {at(0, 0, 0.28), {length, width, body}, yaw}, paint, paint);
  const double back = van ? -0.1 : random.uniform(-0.5, -0.2), top = 0.28 + body;
  add_box(b.surfaces, {at(back, 0, top), {van ? 0.75 * length : 0.5 * length, width - 0.2, cabin}, yaw}, glass, paint);
  add_box(b.surfaces, {at(back, 0, top + cabin), {van ? 0.75 * length : 0.45 * length, width - 0.2, 0.06}, yaw}, paint,
          paint);
  for (const double end : {-0.5, 0.5}) {
    add_box(b.surfaces, {at(end * length, 0, 0.45), {0.04, 0.5, 0.12}, yaw}, plate, plate);
    for (const double side : {-0.38, 0.38})
      add_box(b.surfaces, {at(end * length, side * width, 0.58), {0.04, 0.28, 0.14}, yaw}, lamp, lamp);
  }
}

void add_cars(Building& b, const StreetPiece& p, Random& random) {
  for (const double side : {-1.0, 1.0}) {
    const std::uint32_t share = random.below(70);
    for (double at = kFreeEnd + 3; at < p.length - kFreeEnd - 3; at += random.uniform(5.3, 6.5)) {
      const double left = side * (p.half_road - random.uniform(1.0, 1.1));
      Random own(random.next(), "car");
      if (random.below(100) < share)
        add_car(b, p.at(at, left), random.below(2) == 0 ? p.along : Vector2d(-p.along), own);
    }
  }
}

void add_lamp_post(Building& b, const Vector2d& place, const Vector2d& to_road, Random& random) {
  const Texture metal = texture(Material::kPlain, 0.25f, random), head = texture(Material::kPlain, 0.7f, random);
  const double height = random.uniform(4.8, 5.6), yaw = std::atan2(to_road.y(), to_road.x());
  add_box(b.surfaces, {at_height(place, kKerb), {0.24, 0.24, 0.9}, yaw}, metal, metal);
  add_box(b.surfaces, {at_height(place, kKerb), {0.13, 0.13, height}, yaw}, metal, metal);
  add_box(b.surfaces, {at_height(place + 0.6 * to_road, height), {1.3, 0.08, 0.08}, yaw}, metal, metal);
  add_box(b.surfaces, {at_height(place + 1.2 * to_road, height - 0.1), {0.6, 0.25, 0.1}, yaw}, head, head);
}

void add_sign(Building& b, const Vector2d& place, const Vector2d& along, Random& random) {
  const Texture metal = texture(Material::kPlain, 0.3f, random);
  const double yaw = std::atan2(along.y(), along.x()), size = random.uniform(0.55, 0.9);
  add_box(b.surfaces, {at_height(place, kKerb), {0.07, 0.07, 2.9}, yaw}, metal, metal);
  add_box(b.surfaces, {at_height(place, 2.2), {0.03, size, size}, yaw}, texture(Material::kPoster, 0.5f, random),
          metal);
}

// Trees, lamp posts and furniture on both pavements.
void furnish_street(Building& b, const StreetPiece& p, Random& random) {
  constexpr double kFromKerb = 0.65;  // metres
  for (const double side : {-1.0, 1.0}) {
    const double left = side * (p.half_road + kFromKerb);
    const Vector2d to_road = -side * left_of(p.along);
    const std::uint32_t trees = random.below(2) == 0 ? 45 : 8;
    add_sign(b, p.at(random.uniform(1.5, 4.0), left), p.along, random);
    for (double at = kFreeEnd; at < p.length - kFreeEnd; at += random.uniform(6.0, 11.0)) {
      const Vector2d place = p.at(at, left);
      Random own(random.next(), "furniture");
      const std::uint32_t pick = random.below(100);
      if (pick < trees) {
        add_tree(b, place, own);
      } else if (pick < trees + 20) {
        add_lamp_post(b, place, to_road, own);
      } else if (pick < trees + 28) {
        add_bench(b, place, own);
      } else if (pick < trees + 34) {
        add_board(b, place, own);
      } else if (pick < trees + 42) {
        add_crates(b, place, own);
      } else if (pick < trees + 48) {
        add_sign(b, place, p.along, own);
      }
    }
  }
}

}  // namespace

Area StreetPiece::area() const { return area_between(at(0, -half_road), at(length, half_road)); }

std::vector<StreetPiece> pieces_from(const StreetGrid& grid, std::size_t i, std::size_t j) {
  std::vector<StreetPiece> pieces;
  const Street &x = grid.x(i), &y = grid.y(j);
  if (i + 1 < StreetGrid::kStreets) {
    const double from = x.centre + x.half_road(), to = grid.x(i + 1).centre - grid.x(i + 1).half_road();
    pieces.push_back({0, {from, y.centre}, {1, 0}, to - from, y.half_road()});
  }
  if (j + 1 < StreetGrid::kStreets) {
    const double from = y.centre + y.half_road(), to = grid.y(j + 1).centre - grid.y(j + 1).half_road();
    pieces.push_back({1, {x.centre, from}, {0, 1}, to - from, x.half_road()});
  }
  return pieces;
}

Area crossing_area(const StreetGrid& grid, std::size_t i, std::size_t j) {
  const Vector2d half(grid.x(i).half_road(), grid.y(j).half_road()), centre = grid.crossing(i, j);
  return {centre - half, centre + half};
}

void add_street(Building& b, const StreetPiece& p, const PartSeed& seed, Detail detail) {
  const Texture asphalt = road(seed.town);
  if (detail != Detail::kComplete) {
    add_flat(b, p.area(), 0, asphalt, kCoarseTexel);
    return;
  }
  constexpr double kTile = 8.0;
  const int tiles = std::max(1, static_cast<int>(std::lround(p.length / kTile)));
  for (int i = 0; i < tiles; ++i) {
    const double from = p.length * i / tiles, to = p.length * (i + 1) / tiles;
    add_mark(b, p, {from, -p.half_road}, {to, p.half_road}, 0, asphalt);
  }
  Random random(seed.town, "street", seed.place);
  add_markings(b, p, random);
  add_cars(b, p, random);
  furnish_street(b, p, random);
}

void add_crossing(Building& b, const Area& area, const PartSeed& seed, Detail detail) {
  add_flat(b, area, 0, road(seed.town), detail == Detail::kComplete ? 0 : kCoarseTexel);
  if (detail != Detail::kComplete) return;
  Random random(seed.town, "crossing", seed.place);
  const Vector2d size = area.size();
  for (int i = 0; i < 4; ++i) {
    const Vector2d extent = i < 2 ? Vector2d(0.65, 0.65) : Vector2d{random.uniform(0.8, 3.0), random.uniform(0.8, 3.0)};
    const Vector2d low =
        area.low + Vector2d{random.uniform(0.2, size.x() - extent.x()), random.uniform(0.2, size.y() - extent.y())};
    const Texture look = i < 2 ? texture(Material::kTile, 0.16f, random)
                               : texture(Material::kAsphalt, static_cast<float>(random.uniform(0.14, 0.3)), random);
    add_flat(b, {low, low + extent}, i < 2 ? kLid : kPatch, look);
  }
}

}  // namespace bslam::simulator
