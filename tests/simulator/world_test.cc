#include "simulator/world.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "simulator/tour.h"
#include "small_world.h"

namespace bslam::simulator {
namespace {

TEST(World, HasNoHolesAroundTheTour) {
  ThreadPool pool(2);
  const World world = small_world(1, pool);
  const synthetic::Trajectory tour = make_tour(world.building(), {});
  Random random(1, "rays");
  for (int i = 0; i < 20000; ++i) {
    const Vector3d origin = tour.T_world_body(random.uniform(0, 20)).translation();
    const Vector3d direction = Vector3d{random.normal(), random.normal(), random.normal()}.normalized();
    const auto hit = world.cast(origin, direction);
    ASSERT_TRUE(hit.has_value());
    const Surface& s = world.building().surfaces[hit->surface];
    EXPECT_NEAR((origin + hit->distance * direction - s.origin - hit->a * s.u - hit->b * s.v).norm(), 0.0, 1e-4);
  }
}

TEST(World, ShowsOnlyFrontsOfSurfaces) {
  ThreadPool pool(2);
  const World world = small_world(1, pool);
  const synthetic::Trajectory tour = make_tour(world.building(), {});
  Random random(2, "rays");
  int backs = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d origin = tour.T_world_body(random.uniform(0, 20)).translation();
    const Vector3d direction = Vector3d{random.normal(), random.normal(), random.normal()}.normalized();
    const auto hit = world.cast(origin, direction);
    ASSERT_TRUE(hit.has_value());
    const Surface& s = world.building().surfaces[hit->surface];
    if (s.u.cross(s.v).dot(direction) > 0) ++backs;
  }
  EXPECT_EQ(backs, 0);
}

TEST(World, PacketsAgreeWithSingleRays) {
  ThreadPool pool(2);
  const World world = small_world(1, pool);
  const Vector3d origin(5.0, 4.0, 1.5);
  RayPacket rays;
  Random random(3, "rays");
  std::vector<Vector3d> directions;
  for (int i = 0; i < RayPacket::kSize; ++i) {
    directions.push_back(Vector3d{random.normal(), random.normal(), random.normal()}.normalized());
    rays.x[i] = static_cast<float>(directions.back().x());
    rays.y[i] = static_cast<float>(directions.back().y());
    rays.z[i] = static_cast<float>(directions.back().z());
  }
  float radiance[RayPacket::kSize];
  world.radiance(origin.cast<float>(), rays, 1e-6f, 0.0f, radiance);  // the finest level
  for (int i = 0; i < RayPacket::kSize; ++i) {
    const auto hit = world.cast(origin, directions[static_cast<std::size_t>(i)]);
    ASSERT_TRUE(hit.has_value());
    EXPECT_NEAR(radiance[i], world.radiance(*hit, 1e-6), 0.02f);
  }
}

TEST(World, DoesNotDependOnTheNumberOfThreads) {
  ThreadPool one(1), two(2);
  const World a = small_world(1, one), b = small_world(1, two);
  for (std::size_t i = 0; i < a.building().surfaces.size(); i += 7) {
    const Hit hit{i, 0.37, 0.61, 1.0};
    EXPECT_EQ(a.radiance(hit, 0.001), b.radiance(hit, 0.001));
    EXPECT_EQ(a.radiance(hit, 0.1), b.radiance(hit, 0.1));
  }
}

TEST(Material, StaysWithinPhysicalAlbedo) {
  for (int m = 0; m <= static_cast<int>(Material::kPaving); ++m) {
    const Texture texture{static_cast<Material>(m), 99, 0.5f};
    double sum = 0, squares = 0;
    constexpr int kSide = 60;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const float a = albedo(texture, 0.02f * static_cast<float>(x), 0.02f * static_cast<float>(y), 1.2f, 1.2f);
        ASSERT_GE(a, 0.03f);
        ASSERT_LE(a, 0.95f);
        sum += a;
        squares += a * a;
      }
    }
    const double mean = sum / (kSide * kSide),
                 deviation = std::sqrt(std::max(0.0, squares / (kSide * kSide) - mean * mean));
    EXPECT_GT(mean, 0.15);
    const bool smooth = texture.material == Material::kLamp || texture.material == Material::kSky ||
                        texture.material == Material::kHorizon || texture.material == Material::kHills;  // over a metre
    if (!smooth) {
      EXPECT_GT(deviation, 0.01) << "material " << m;
    }
  }
}

}  // namespace
}  // namespace bslam::simulator
