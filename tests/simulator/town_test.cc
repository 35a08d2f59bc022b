#include "simulator/town.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "base/random.h"
#include "simulator/world.h"

namespace bslam::simulator {
namespace {

// A path of 60 m along the street x 5, from a crossing.
std::vector<Vector2d> path_from(const StreetGrid& grid, std::size_t j) {
  std::vector<Vector2d> path;
  for (double at = 0; at <= 60; at += 4) path.emplace_back(grid.crossing(5, j) + Vector2d(1.0, at));
  return path;
}

using Key = std::tuple<double, double, double, double, double, std::uint32_t, float>;

Key key_of(const Surface& s) {
  return {s.origin.x(), s.origin.y(), s.origin.z(), s.u.norm(), s.v.norm(), s.texture.seed, s.texture.shade};
}

// The surfaces within `reach` metres of a place.
std::multiset<Key> surfaces_at(const Building& town, const Vector2d& place, double reach) {
  std::multiset<Key> keys;
  for (const Surface& s : town.surfaces) {
    if (distance_to_surfaces({&s, 1}, {place.x(), place.y(), 0}) < reach) keys.insert(key_of(s));
  }
  return keys;
}

TEST(Town, IsTheSameFromDifferentSections) {
  const StreetGrid grid = make_street_grid(1);
  const Building a = make_town(grid, 1, path_from(grid, 4)), b = make_town(grid, 1, path_from(grid, 5));
  const Vector2d between = grid.crossing(5, 5);
  const auto from_a = surfaces_at(a, between, 80), from_b = surfaces_at(b, between, 80);
  EXPECT_GT(from_a.size(), 3000u);
  EXPECT_EQ(from_a, from_b);
  const Building other = make_town(make_street_grid(1), 2, path_from(grid, 5));
  EXPECT_NE(surfaces_at(other, between, 80), from_b);
}

TEST(Town, HousesAreTheSameWithLessDetail) {
  const StreetGrid grid = make_street_grid(1);
  const Building full = make_town(grid, 1, path_from(grid, 5)),
                 coarse = make_town(grid, 1, path_from(grid, 5), {.complete = 0.1, .houses = 110});
  std::set<Key> all;
  for (const Surface& s : full.surfaces) all.insert(key_of(s));
  const auto is_house = [](const Surface& s) { return s.v.z() > 5 && s.v.z() < 20; };
  std::size_t houses = 0;
  for (const Surface& s : coarse.surfaces) {
    const bool near = distance_to_surfaces({&s, 1}, {full.tour[7].x(), full.tour[7].y(), 0}) < 70;
    if (!near || !is_house(s)) continue;
    ++houses;
    EXPECT_TRUE(all.contains(key_of(s)));
  }
  EXPECT_GT(houses, 50u);
}

TEST(Town, ConsistsOfRectanglesOfDifferentTextures) {
  const StreetGrid grid = make_street_grid(2);
  const Building town = make_town(grid, 2, path_from(grid, 5));
  EXPECT_LT(town.surfaces.size(), 90'000u);
  std::map<std::tuple<std::uint32_t, double>, int> walls;
  for (const Surface& s : town.surfaces) {
    EXPECT_NEAR(s.u.dot(s.v), 0.0, 1e-6);
    EXPECT_GT(s.u.cross(s.v).norm(), 0.0);
    if (s.v.z() > 3 && s.u.norm() > 3) ++walls[{s.texture.seed, s.pattern_origin.x()}];
  }
  EXPECT_GT(walls.size(), 1000u);
  for (const auto& [wall, count] : walls) EXPECT_EQ(count, 1);
}

TEST(Town, HasNoHolesAroundTheStreets) {
  ThreadPool pool(2);
  const StreetGrid grid = make_street_grid(1);
  const World world(make_town(grid, 1, path_from(grid, 5), {.complete = 60, .houses = 120}),
                    {.texel = 0.5, .texel_per_distance = 0.05, .light_texel = 20, .ambient_rays = 1}, pool);
  Random random(1, "rays");
  int backs = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector2d& place = world.building().tour[random.below(16)];
    const Vector3d direction = Vector3d{random.normal(), random.normal(), random.normal()}.normalized();
    const auto hit = world.cast({place.x(), place.y(), 1.5}, direction);
    ASSERT_TRUE(hit.has_value());
    const Surface& s = world.building().surfaces[hit->surface];
    if (s.u.cross(s.v).dot(direction) > 0) ++backs;
  }
  EXPECT_LT(backs, 20);
}

}  // namespace
}  // namespace bslam::simulator
