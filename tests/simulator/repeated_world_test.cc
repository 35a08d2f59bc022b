#include "simulator/repeated_world.h"

#include <gtest/gtest.h>

#include "simulator/tour.h"
#include "simulator/world.h"

namespace bslam::simulator {
namespace {

constexpr WorldOptions kCoarse{.texel = 0.05, .light_texel = 0.5, .ambient_rays = 2};

// Returns directions uniformly distributed on the sphere, on a spiral.
std::vector<Vector3d> directions() {
  constexpr int kCount = 400;
  std::vector<Vector3d> out;
  for (int i = 0; i < kCount; ++i) {
    const double z = 1 - (2.0 * i + 1) / kCount, angle = 2.399963 * i, r = std::sqrt(1 - z * z);
    out.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  return out;
}

struct Place {
  Vector3d at;
  bool rotated;  // by 180 degrees about z
};

// Returns the fraction of rays, among those that end within `reach` at one of the places, that hit the same texture at
// the same position and distance.
double similarity(const World& world, const Place& a, const Place& b, double reach, int& rays) {
  int same = 0;
  rays = 0;
  const auto look = [&](const Place& p, const Vector3d& d) {
    return world.cast(p.at, p.rotated ? Vector3d(-d.x(), -d.y(), d.z()) : d);
  };
  for (const Vector3d& d : directions()) {
    const auto hit_a = look(a, d), hit_b = look(b, d);
    if (!hit_a || !hit_b || (hit_a->distance > reach && hit_b->distance > reach)) continue;
    ++rays;
    const auto& surfaces = world.building().surfaces;
    same += surfaces[hit_a->surface].texture.seed == surfaces[hit_b->surface].texture.seed &&
            std::abs(hit_a->distance - hit_b->distance) < 1e-3 && std::abs(hit_a->a - hit_b->a) < 1e-3;
  }
  return static_cast<double>(same) / rays;
}

TEST(Corridor, IsPeriodicAndSymmetric) {
  ThreadPool pool(2);
  const World world(make_corridor(3), kCoarse, pool);
  int rays = 0;
  const Place place{{7.2, -1.1, 1.5}, false};
  EXPECT_GT(similarity(world, place, {place.at + Vector3d(kCorridorPeriod, 0, 0), false}, 4, rays), 0.99);
  EXPECT_GT(rays, 300);
  EXPECT_GT(similarity(world, place, {{18 - place.at.x(), -place.at.y(), place.at.z()}, true}, 100, rays), 0.99);
  EXPECT_LT(similarity(world, place, {place.at + Vector3d(1.0, 0, 0), false}, 4, rays), 0.5);
}

TEST(TwinRooms, LookAlikeAndThePassageIsUnique) {
  ThreadPool pool(2);
  const World world(make_twin_rooms(3), kCoarse, pool);
  int rays = 0;
  const Place first{{-5.2, 1.5, 1.5}, false}, second{{5.2, -1.5, 1.5}, true};
  EXPECT_GT(similarity(world, first, second, 3.5, rays), 0.99);
  EXPECT_GT(rays, 150);
  EXPECT_LT(similarity(world, {{-0.8, 0, 1.5}, false}, {{0.8, 0, 1.5}, true}, 2.0, rays), 0.9);
}

TEST(RepeatedWorld, HasAClearTour) {
  for (const WorldKind kind : {WorldKind::kCorridor, WorldKind::kTwinRooms, WorldKind::kOutdoor}) {
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
      const Building building = make_building(kind, seed);
      const synthetic::Trajectory t = make_tour(building, {.duration_s = 60, .seed = seed});
      double nearest = 1e9;
      for (double time = 0; time < 60; time += 0.05) {
        nearest = std::min(nearest, distance_to_surfaces(building.surfaces, t.T_world_body(time).translation()));
      }
      EXPECT_GE(nearest, Building::kTourClearance) << static_cast<int>(kind) << " seed " << seed;
    }
  }
}

}  // namespace
}  // namespace bslam::simulator
