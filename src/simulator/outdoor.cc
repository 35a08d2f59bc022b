#include "simulator/outdoor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/random.h"
#include "simulator/walls.h"

namespace bslam::simulator {
namespace {

constexpr double kHalfX = 17.0, kHalfY = 13.0;  // metres: half the size of the square
constexpr double kBlockX = 6.0, kBlockY = 3.0;  // half the size of the block in the middle
constexpr double kTourX = 10.5, kTourY = 7.0;   // half the size of the tour
constexpr double kDepth = 6.0;                  // of the houses around the square
constexpr double kFree = 1.3;                   // distance of street furniture from the tour
constexpr double kGroundTile = 4.0, kSky = 90.0, kSkyHeight = 70.0;

Texture texture(Material material, float shade, Random& random) {
  return {material, static_cast<std::uint32_t>(random.next()), shade};
}

void add_ground(Building& b, const Vector2d& low, const Vector2d& high, const Texture& look) {
  const Vector2d size = high - low;
  b.surfaces.push_back({at_height(low, 0), {size.x(), 0, 0}, {0, size.y(), 0}, look, low});
}

// Ground in tiles, so that only those near the tour need fine texels. Their common pattern continues across them.
void add_tiled_ground(Building& b, const Vector2d& low, const Vector2d& high, const Texture& look) {
  const auto count = [](double length) { return std::max(1, static_cast<int>(std::ceil(length / kGroundTile))); };
  const Vector2d size = high - low;
  const int columns = count(size.x()), rows = count(size.y());
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      const Vector2d step(size.x() / columns, size.y() / rows), from = low + Vector2d(i * step.x(), j * step.y());
      add_ground(b, from, from + step, look);
    }
  }
}

// A frame of ground around the rectangle of half size `inner`.
void add_ring(Building& b, const Vector2d& inner, const Vector2d& outer, const Texture& look) {
  add_ground(b, -outer, {outer.x(), -inner.y()}, look);
  add_ground(b, {-outer.x(), inner.y()}, outer, look);
  add_ground(b, {-outer.x(), -inner.y()}, {-inner.x(), inner.y()}, look);
  add_ground(b, {inner.x(), -inner.y()}, {outer.x(), inner.y()}, look);
}

// The sky and the horizon: the inside of a large box.
void add_sky(Building& b, Random& random) {
  b.surfaces.push_back(
      {{-kSky, -kSky, kSkyHeight}, {0, 2 * kSky, 0}, {2 * kSky, 0, 0}, texture(Material::kSky, 0.8f, random)});
  const Texture horizon = texture(Material::kHorizon, 0.5f, random);
  constexpr double kBelow = -0.5;
  for (int side = 0; side < 4; ++side) {
    const double angle = 0.5 * std::numbers::pi * side, c = std::cos(angle), s = std::sin(angle);
    const auto turned = [&](double x, double y) { return Vector2d(c * x - s * y, s * x + c * y); };
    const Vector2d start = turned(kSky, kSky), end = turned(-kSky, kSky);
    b.surfaces.push_back({at_height(end, kBelow),
                          at_height(start - end, 0),
                          {0, 0, kSkyHeight - kBelow},
                          horizon,
                          {2 * kSky * side, 0}});
    // The inner side of the box is the visible one.
    Surface& wall = b.surfaces.back();
    const Vector3d normal = wall.u.cross(wall.v);
    if (normal.dot(-wall.origin - 0.5 * wall.u) < 0) {
      wall.origin += wall.u;
      wall.u = -wall.u;
    }
  }
}

// A facade: from `start` along `along`, with the street on its left, as seen along it.
struct Facade {
  Vector2d start, along;
  double length, height;
};

Vector2d left_of(const Vector2d& v) { return {-v.y(), v.x()}; }

// A rectangle in front of a facade, facing the street: `at` metres along it, `z` above the ground.
void add_panel(Building& b, const Facade& f, double at, double z, const Vector2d& size, const Texture& look) {
  constexpr double kInFront = 0.03;  // metres
  const Vector2d corner = f.start + at * f.along + kInFront * left_of(f.along);
  b.surfaces.push_back(
      {at_height(corner + size.x() * f.along, z), at_height(-size.x() * f.along, 0), {0, 0, size.y()}, look});
}

// Windows in rows, a door and posters.
void decorate(Building& b, const Facade& f, Random& random) {
  const double storey = random.uniform(2.7, 3.3);
  const Vector2d window(random.uniform(0.8, 1.2), random.uniform(1.2, 1.7));
  const int columns = std::max(1, static_cast<int>(f.length / random.uniform(1.9, 2.6)));
  const double pitch = f.length / columns;
  const int door = static_cast<int>(random.below(static_cast<std::uint32_t>(columns)));
  const Texture sill = texture(Material::kPlaster, 0.7f, random);
  for (int row = 0; (row + 1) * storey < f.height + 0.2; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double middle = (column + 0.5) * pitch;
      if (row == 0 && column == door) {
        add_panel(b, f, middle - 0.55, 0, {1.1, 2.2}, texture(Material::kWood, 0.4f, random));
      } else if (row == 0 && random.below(3) == 0) {
        add_panel(b, f, middle - 0.5, 0.8, {1.0, 1.4}, texture(Material::kPoster, 0.5f, random));
      } else {
        const double z = row * storey + 0.9;
        add_panel(b, f, middle - 0.5 * window.x(), z, window, texture(Material::kWindow, 0.5f, random));
        add_panel(b, f, middle - 0.5 * window.x() - 0.08, z - 0.12, {window.x() + 0.16, 0.1}, sill);
      }
    }
  }
}

Material facade_material(Random& random) {
  constexpr std::array kMaterials = {Material::kBrick, Material::kPlaster, Material::kBrick, Material::kTile};
  return kMaterials[random.below(kMaterials.size())];
}

// A house: a box, whose base begins at `start` and extends `length` along `along` and `depth` away from the street.
void add_house(Building& b, const Vector2d& start, const Vector2d& along, double length, double depth, double height,
               Random& random) {
  const Vector2d centre = start + 0.5 * length * along - 0.5 * depth * left_of(along);
  const Texture wall = texture(facade_material(random), static_cast<float>(random.uniform(0.35, 0.6)), random);
  add_box(b.surfaces, {at_height(centre, 0), {length, depth, height}, std::atan2(along.y(), along.x())}, wall,
          texture(Material::kTile, 0.4f, random));
  decorate(b, {start, along, length, height}, random);
}

// Houses of different width and height along one side of the square, with narrow gaps between them.
void add_row(Building& b, const Vector2d& start, const Vector2d& along, double length, Random& random) {
  double at = 0;
  while (length - at > 3.5) {
    const double left = length - at, wanted = random.uniform(5.0, 8.5), width = left - wanted < 3.5 ? left : wanted;
    const double back = random.uniform(0, 0.7);
    add_house(b, start + at * along - back * left_of(along), along, width, kDepth, random.uniform(5.5, 11.0), random);
    at += width + random.uniform(0.6, 2.0);
  }
}

double distance_to_tour(const Building& b, const Vector2d& place) {
  double nearest = 1e9;
  for (const Vector2d& p : b.tour) nearest = std::min(nearest, (p - place).norm());
  return nearest;
}

void add_tree(Building& b, const Vector2d& place, Random& random) {
  const double trunk = random.uniform(2.4, 3.2), width = random.uniform(0.22, 0.34);
  const Texture bark = texture(Material::kWood, 0.3f, random);
  for (const double yaw : {0.0, 0.25 * std::numbers::pi})
    add_box(b.surfaces, {at_height(place, 0), {width, width, trunk + 0.8}, yaw}, bark, bark);
  const Texture leaves = texture(Material::kLeaves, 0.32f, random);
  for (int i = 0; i < 16; ++i) {
    const double size = random.uniform(0.5, 1.1), angle = random.uniform(0, 2 * std::numbers::pi);
    const double out = random.uniform(0, 1.1), up = random.uniform(0, 2.0) * (1.3 - 0.5 * out);
    const Vector2d at = place + out * Vector2d(std::cos(angle), std::sin(angle));
    add_box(b.surfaces, {at_height(at, trunk + up), {size, size, 0.8 * size}, random.uniform(0, 1.5)}, leaves, leaves);
  }
}

void add_bench(Building& b, const Vector2d& place, Random& random) {
  const Texture wood = texture(Material::kPlanks, 0.45f, random), stone = texture(Material::kPlaster, 0.5f, random);
  const double yaw = random.uniform(0, std::numbers::pi);
  const Vector2d along(std::cos(yaw), std::sin(yaw));
  for (const double side : {-0.6, 0.6})
    add_box(b.surfaces, {at_height(place + side * along, 0), {0.2, 0.4, 0.42}, yaw}, stone, stone);
  add_box(b.surfaces, {at_height(place, 0.42), {1.7, 0.45, 0.06}, yaw}, wood, wood);
}

void add_crates(Building& b, const Vector2d& place, Random& random) {
  const double yaw = random.uniform(0, std::numbers::pi);
  double z = 0;
  for (std::uint32_t i = 0, n = 1 + random.below(3); i < n; ++i) {
    const double size = random.uniform(0.45, 0.8);
    const Texture look = texture(random.below(2) == 0 ? Material::kCardboard : Material::kPlanks, 0.5f, random);
    add_box(b.surfaces, {at_height(place, z), {size, size, 0.8 * size}, yaw + random.uniform(-0.3, 0.3)}, look, look);
    z += 0.8 * size;
  }
}

void add_hedge(Building& b, const Vector2d& place, Random& random) {
  const Texture leaves = texture(Material::kLeaves, 0.28f, random);
  add_box(b.surfaces,
          {at_height(place, 0),
           {random.uniform(1.2, 2.4), 0.7, random.uniform(0.7, 1.1)},
           random.below(2) * 0.5 * std::numbers::pi},
          leaves, leaves);
}

// A board with posters on both sides.
void add_board(Building& b, const Vector2d& place, Random& random) {
  const double yaw = random.uniform(0, std::numbers::pi);
  const Texture post = texture(Material::kWood, 0.3f, random);
  const Vector2d along(std::cos(yaw), std::sin(yaw));
  for (const double side : {-0.75, 0.75})
    add_box(b.surfaces, {at_height(place + side * along, 0), {0.1, 0.1, 2.1}, yaw}, post, post);
  add_box(b.surfaces, {at_height(place, 0.7), {1.4, 0.06, 1.3}, yaw}, texture(Material::kPoster, 0.5f, random), post);
}

// Street furniture at random places that are free.
void furnish_square(Building& b, Random& random) {
  std::vector<Vector2d> taken;
  const auto free_place = [&](double radius) -> std::optional<Vector2d> {
    for (int attempt = 0; attempt < 60; ++attempt) {
      const Vector2d p(random.uniform(-kHalfX + 1.2, kHalfX - 1.2), random.uniform(-kHalfY + 1.2, kHalfY - 1.2));
      const bool in_block = std::abs(p.x()) < kBlockX + radius && std::abs(p.y()) < kBlockY + radius;
      const bool near_other = std::ranges::any_of(taken, [&](const Vector2d& t) { return (t - p).norm() < 2.2; });
      if (in_block || near_other || distance_to_tour(b, p) < radius + kFree) continue;
      taken.push_back(p);
      return p;
    }
    return std::nullopt;
  };
  using Add = void (*)(Building&, const Vector2d&, Random&);
  struct Kind {
    Add add;
    int count;
    double radius;
  };
  constexpr std::array<Kind, 5> kKinds = {Kind{add_tree, 9, 0.9}, Kind{add_bench, 6, 0.9}, Kind{add_crates, 8, 0.6},
                                          Kind{add_hedge, 8, 1.3}, Kind{add_board, 6, 0.9}};
  for (const Kind& kind : kKinds) {
    for (int i = 0; i < kind.count; ++i) {
      if (const auto place = free_place(kind.radius)) kind.add(b, *place, random);
    }
  }
}

}  // namespace

Building make_outdoor(std::uint64_t seed) {
  constexpr double kCornerRadius = 2.2;  // metres
  Building b;
  b.tour = rounded_loop({{-kTourX, -kTourY}, {kTourX, -kTourY}, {kTourX, kTourY}, {-kTourX, kTourY}}, kCornerRadius,
                        Building::kTourStep);
  Random random(seed, "outdoor");
  const Vector2d square(kHalfX + 1, kHalfY + 1), town(2.4 * kHalfX, 2.4 * kHalfY), all(kSky + 1, kSky + 1);
  add_tiled_ground(b, -square, square, texture(Material::kPlaster, 0.34f, random));
  add_ring(b, square, town, texture(Material::kPlaster, 0.38f, random));
  add_ring(b, town, all, texture(Material::kLeaves, 0.30f, random));
  add_sky(b, random);
  add_row(b, {-kHalfX, -kHalfY}, {1, 0}, 2 * kHalfX, random);
  add_row(b, {kHalfX, -kHalfY}, {0, 1}, 2 * kHalfY, random);
  add_row(b, {kHalfX, kHalfY}, {-1, 0}, 2 * kHalfX, random);
  add_row(b, {-kHalfX, kHalfY}, {0, -1}, 2 * kHalfY, random);
  // The block in the middle: two houses, each with a facade to both streets.
  for (const double sign : {-1.0, 1.0}) {
    const double height = random.uniform(4.5, 7.5);
    add_house(b, {sign * kBlockX, -sign * kBlockY}, {-sign, 0}, 2 * kBlockX, kBlockY, height, random);
    decorate(b, {{-sign * kBlockX, -sign * kBlockY}, {0, sign}, 2 * kBlockY, 4.5}, random);
  }
  furnish_square(b, random);
  constexpr double kSunDistance = 60.0;
  const double turn = random.uniform(0, 2 * std::numbers::pi);
  const Vector3d to_sun = Vector3d(0.55 * std::cos(turn), 0.55 * std::sin(turn), 0.83).normalized();
  b.lamps.push_back({kSunDistance * to_sun, 0.95 * kSunDistance * kSunDistance});
  b.rooms.push_back({"square", {-kHalfX, -kHalfY}, {kHalfX, kHalfY}, kSkyHeight});
  return b;
}

}  // namespace bslam::simulator
