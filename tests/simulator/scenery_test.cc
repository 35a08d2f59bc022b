#include "simulator/scenery.h"

#include <gtest/gtest.h>

#include <cmath>

#include "simulator/recorder.h"

namespace bslam::simulator {
namespace {

constexpr WorldOptions kCoarseSection{.texel = 0.04, .texel_per_distance = 0.01, .light_texel = 1.0, .ambient_rays = 2};

Scenery short_drive() { return make_scenery(WorldKind::kTown, 3, {.seed = 3, .length_m = 300}, kCoarseSection); }

camera::Rig small_camera() {
  const camera::Camera camera{
      .name = "front", .model = camera::Pinhole({60, 60, 59.5, 37.5}), .width = 120, .height = 76, .mask_file = {}};
  const Eigen::Matrix3d forward{{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}};
  return camera::Rig({{camera, geometry::SE3(Eigen::Quaterniond(forward), Vector3d::Zero())}});
}

TEST(Scenery, ImagesContinueAcrossSections) {
  ThreadPool pool(2);
  const Scenery scenery = short_drive();
  ASSERT_EQ(scenery.section_ends.size(), 3u);
  Shot shot;
  shot.scene_time_s = scenery.section_ends[0];
  std::vector<image::Image> images;
  for (const std::size_t section : {0u, 1u}) {
    const World world(scenery.building(section), scenery.world, pool);
    images.push_back(Recorder(world, small_camera(), scenery.trajectory, {.noise = 0}, 0.0, pool).render(shot));
  }
  int sum = 0, different = 0, bright = 0;
  for (int y = 0; y < 76; ++y) {
    for (int x = 0; x < 120; ++x) {
      const int difference = std::abs(images[0].row(y)[x] - images[1].row(y)[x]);
      sum += difference;
      different += difference > 25 ? 1 : 0;
      bright += images[0].row(y)[x] > 40 ? 1 : 0;
    }
  }
  EXPECT_LT(sum / (76.0 * 120.0), 2.5);
  EXPECT_LT(different, 76 * 120 / 100);
  EXPECT_GT(bright, 76 * 120 / 2);
}

TEST(Scenery, SectionsDoNotDependOnTheNumberOfThreads) {
  ThreadPool one(1), two(2);
  const Scenery scenery = short_drive();
  const World a(scenery.building(1), scenery.world, one), b(scenery.building(1), scenery.world, two);
  for (std::size_t i = 0; i < a.building().surfaces.size(); i += 11) {
    const Hit hit{i, 0.37, 0.61, 1.0};
    ASSERT_EQ(a.radiance(hit, 0.001), b.radiance(hit, 0.001));
    ASSERT_EQ(a.radiance(hit, 0.1), b.radiance(hit, 0.1));
  }
}

TEST(Scenery, DrivesKeepClearOfAllSurfaces) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Scenery scenery = make_scenery(WorldKind::kTown, seed, {.seed = seed, .length_m = 600}, {});
    double from = 0;
    for (std::size_t section = 0; section < scenery.section_ends.size(); ++section) {
      const Building obstacles = scenery.obstacles(section);
      for (double time = from; time < scenery.section_ends[section]; time += 0.2) {  // less than 2 m
        const Vector3d place = scenery.trajectory.T_world_body(time).translation();
        EXPECT_GT(distance_to_surfaces(obstacles.surfaces, place), 1.3) << "seed " << seed << ", " << time << " s";
      }
      from = scenery.section_ends[section];
    }
  }
}

TEST(Scenery, FindsTheSectionOfATime) {
  const Scenery scenery = short_drive();
  EXPECT_EQ(scenery.section_at(-0.1), 0u);
  EXPECT_EQ(scenery.section_at(scenery.section_ends[0] - 0.01), 0u);
  EXPECT_EQ(scenery.section_at(scenery.section_ends[0] + 0.01), 1u);
  EXPECT_EQ(scenery.section_at(scenery.section_ends[2] + 1), 2u);
}

TEST(Scenery, OtherWorldsHaveOneSection) {
  const Scenery scenery = make_scenery(WorldKind::kBuilding, 1, {.duration_s = 12}, {});
  EXPECT_EQ(scenery.section_ends, std::vector<double>{12.0});
  EXPECT_EQ(scenery.world.texel, WorldOptions{}.texel);
  EXPECT_EQ(scenery.building(0).surfaces.size(), make_building(1).surfaces.size());
}

}  // namespace
}  // namespace bslam::simulator
