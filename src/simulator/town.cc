#include "simulator/town.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/random.h"
#include "simulator/town_block.h"
#include "simulator/town_street.h"

namespace bslam::simulator {
namespace {

constexpr double kSkyHeight = 150.0, kOutskirts = 110.0;  // metres; around the town
constexpr double kTile = 80.0;                            // metres: size of the pieces of the background

// Calls `add` with the edges of the pieces of a length.
template <typename Add>
void for_each_tile(double from, double to, const Add& add) {
  const int count = std::max(1, static_cast<int>(std::ceil((to - from) / kTile)));
  for (int i = 0; i < count; ++i) add(from + (to - from) * i / count, from + (to - from) * (i + 1) / count);
}

Area town_area(const StreetGrid& grid) {
  const auto edge = [](const Street& s, double sign) { return s.centre + sign * s.half_width; };
  return {{edge(grid.streets[0].front(), -1), edge(grid.streets[1].front(), -1)},
          {edge(grid.streets[0].back(), 1), edge(grid.streets[1].back(), 1)}};
}

void add_meadow(Building& b, const Area& area, const Texture& look) {
  for_each_tile(area.low.x(), area.high.x(), [&](double x0, double x1) {
    for_each_tile(area.low.y(), area.high.y(), [&](double y0, double y1) {
      add_flat(b, {{x0, y0}, {x1, y1}}, 0, look);
    });
  });
}

// Meadows around the town, and the inside of a large box with sky and hills.
void add_background(Building& b, const Area& town, std::uint64_t seed) {
  Random random(seed, "background");
  const Vector2d outskirts = Vector2d::Constant(kOutskirts);
  const Area all{town.low - outskirts, town.high + outskirts};
  const Texture meadow = texture(Material::kLeaves, 0.30f, random), sky = texture(Material::kSky, 0.8f, random),
                hills = texture(Material::kHills, 0.5f, random);
  add_meadow(b, {all.low, {all.high.x(), town.low.y()}}, meadow);
  add_meadow(b, {{all.low.x(), town.high.y()}, all.high}, meadow);
  add_meadow(b, {{all.low.x(), town.low.y()}, {town.low.x(), town.high.y()}}, meadow);
  add_meadow(b, {{town.high.x(), town.low.y()}, {all.high.x(), town.high.y()}}, meadow);
  for_each_tile(all.low.x(), all.high.x(), [&](double x0, double x1) {
    for_each_tile(all.low.y(), all.high.y(), [&](double y0, double y1) {
      b.surfaces.push_back({{x0, y0, kSkyHeight}, {0, y1 - y0, 0}, {x1 - x0, 0, 0}, sky, {y0, x0}});
    });
  });
  const Vector2d size = all.size(), se(all.high.x(), all.low.y()), nw(all.low.x(), all.high.y());
  double at = 0;
  for (const Facade& wall :
       {Facade{all.low, {1, 0}, size.x(), kSkyHeight}, Facade{se, {0, 1}, size.y(), kSkyHeight},
        Facade{all.high, {-1, 0}, size.x(), kSkyHeight}, Facade{nw, {0, -1}, size.y(), kSkyHeight}}) {
    for_each_tile(0, wall.length, [&](double from, double to) {
      b.surfaces.push_back({at_height(wall.start + to * wall.along, 0),
                            at_height((from - to) * wall.along, 0),
                            {0, 0, kSkyHeight},
                            hills,
                            {-at - to, 0}});
    });
    at += wall.length;
  }
}

}  // namespace

Building make_town(const StreetGrid& grid, std::uint64_t seed, std::vector<Vector2d> path, const TownDetail& detail) {
  Building b;
  b.tour = std::move(path);
  const auto level_of = [&](const Area& area) {
    double distance = std::numeric_limits<double>::infinity();
    for (const Vector2d& p : b.tour) distance = std::min(distance, area.distance(p));
    return distance < detail.complete ? Detail::kComplete
           : distance < detail.houses ? Detail::kHouses
                                      : Detail::kOutline;
  };
  const auto add = [&](const Area& area, const auto& add_part) {
    const Detail level = level_of(area);
    if (level != Detail::kOutline || detail.background) add_part(level);
  };
  const std::size_t n = StreetGrid::kStreets;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const std::uint64_t place = i * n + j;
      if (i + 1 < n && j + 1 < n) {
        const Area area = block_area(grid, i, j);
        add(area, [&](Detail level) { add_block(b, area, {seed, place}, level); });
      }
      add(crossing_area(grid, i, j), [&](Detail level) {
        add_crossing(b, crossing_area(grid, i, j), {seed, place}, level);
      });
      for (const StreetPiece& piece : pieces_from(grid, i, j))
        add(piece.area(), [&](Detail level) { add_street(b, piece, {seed, 2 * place + piece.axis}, level); });
    }
  }
  if (detail.background) add_background(b, town_area(grid), seed);
  Random random(seed, "sun");
  const double turn = random.uniform(0, 2 * std::numbers::pi);
  b.sun = Sun{Vector3d(0.55 * std::cos(turn), 0.55 * std::sin(turn), 0.83).normalized(), 0.95};
  return b;
}

}  // namespace bslam::simulator
