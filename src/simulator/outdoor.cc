#include "simulator/outdoor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/random.h"
#include "simulator/outdoor_parts.h"
#include "simulator/walls.h"

namespace bslam::simulator {
namespace {

constexpr double kHalfX = 17.0, kHalfY = 13.0;  // metres: half the size of the square
constexpr double kBlockX = 6.0, kBlockY = 3.0;  // half the size of the block in the middle
constexpr double kTourX = 10.5, kTourY = 7.0;   // half the size of the tour
constexpr double kDepth = 6.0;                  // metres, depth of the houses around the square
constexpr double kFree = 1.3;                   // distance of street furniture from the tour
constexpr double kSky = 90.0, kSkyHeight = 70.0;

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

// Street furniture at random places that are free.
void furnish_square(Building& b, Random& random) {
  std::vector<Vector2d> taken;
  const auto free_place = [&](double radius) -> std::optional<Vector2d> {
    for (int attempt = 0; attempt < 60; ++attempt) {
      const double y = random.uniform(-kHalfY + 1.2, kHalfY - 1.2), x = random.uniform(-kHalfX + 1.2, kHalfX - 1.2);
      const Vector2d p(x, y);
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
