// Free and occupied space: rays, the octree and the occupancy grid.
#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "geometry/so3.h"
#include "map_export/exported_map.h"
#include "map_export/occupancy_grid.h"
#include "map_export/octree.h"

namespace bslam::map_export {
namespace {

// Scans of a room of 6.1 x 4.1 m around the origin, walls from -1 to 1 m, from several places in it.
std::vector<Scan> scans_of_room() {
  std::vector<Scan> scans;
  for (int i = 0; i < 12; ++i) {
    Scan scan{{-2.0 + 0.35 * i, 0.4 * std::sin(i), 0.0}, 0.0, {}};
    for (int a = 0; a < 360; ++a) {
      const double angle = (a + 0.5) * std::numbers::pi / 180;
      const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
      const double to_x = ((direction.x() > 0 ? 3.05 : -3.05) - scan.origin.x()) / direction.x();
      const double to_y = ((direction.y() > 0 ? 2.05 : -2.05) - scan.origin.y()) / direction.y();
      const Eigen::Vector2d wall = scan.origin.head<2>() + std::min(to_x, to_y) * direction;
      for (const double z : {-0.8, 0.0, 0.8}) scan.rays.push_back({{wall.x(), wall.y(), z}, 0.01});
    }
    scans.push_back(std::move(scan));
  }
  return scans;
}

TEST(Carving, EndsBeforeUncertainLandmarks) {
  const CarvingOptions options{0.1, 5.0};
  const Eigen::Vector3d origin(1, 0, 0);
  const CarvedRay certain = carve(origin, {{1, 3, 0}, 0.05}, options);
  EXPECT_TRUE(certain.occupied);
  EXPECT_EQ(certain.free_end, Eigen::Vector3d(1, 3, 0));
  const CarvedRay uncertain = carve(origin, {{1, 3, 0}, 0.5}, options);
  EXPECT_FALSE(uncertain.occupied);
  EXPECT_LT((uncertain.free_end - Eigen::Vector3d(1, 2, 0)).norm(), 1e-12);
  EXPECT_EQ(carve(origin, {{1, 3, 0}, 10}, options).free_end, origin);
  const CarvedRay far = carve(origin, {{1, 50, 0}, 0.05}, options);
  EXPECT_FALSE(far.occupied);
  EXPECT_LT((far.free_end - Eigen::Vector3d(1, 5, 0)).norm(), 1e-12);
  EXPECT_EQ(carve(origin, {origin, 0.05}, options).free_end, origin);
}

TEST(Carving, CellsFitTheDepthOfTheScene) {
  EXPECT_DOUBLE_EQ(default_resolution(4.0), 0.1);
  EXPECT_DOUBLE_EQ(default_resolution(9.0), 0.2);
  EXPECT_DOUBLE_EQ(default_resolution(0.25), 0.005);
  EXPECT_DOUBLE_EQ(default_resolution(0), 0.1);
}

TEST(OctreeExport, IsReadByOctomapWithFreeSpaceWithinWalls) {
  const auto file = octree_of(scans_of_room(), {0.1, 20.0});
  ASSERT_TRUE(file) << file.error().message();
  std::istringstream in(file->bytes);
  octomap::OcTree tree(1.0);
  ASSERT_TRUE(tree.readBinary(in));
  EXPECT_DOUBLE_EQ(tree.getResolution(), 0.1);
  const auto occupied = [&](float x, float y, float z) {
    const octomap::OcTreeNode* node = tree.search(x, y, z);
    return node ? static_cast<int>(tree.isNodeOccupied(node)) : -1;
  };
  for (const float x : {-2.0f, 0.0f, 2.0f}) EXPECT_EQ(occupied(x, 0.05f, 0), 0) << x;
  EXPECT_EQ(occupied(3.05f, 0.05f, 0), 1);
  EXPECT_EQ(occupied(-3.05f, 0.05f, 0), 1);
  EXPECT_EQ(occupied(5, 0, 0), -1);
  std::size_t leaves = 0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) ++leaves;
  EXPECT_EQ(leaves, file->occupied + file->free);
}

TEST(OctreeExport, RejectsCellsThatAreTooSmall) {
  const auto file = octree_of(scans_of_room(), {1e-5, 20.0});
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().key, "--resolution");
}

Cell cell_at(const OccupancyGrid& grid, double x, double y) {
  return grid.at(static_cast<int>(std::floor((x - grid.x) / grid.resolution)),
                 static_cast<int>(std::floor((y - grid.y) / grid.resolution)));
}

TEST(OccupancyGrid, HasFreeSpaceWithinWalls) {
  const OccupancyGrid grid = occupancy_grid(scans_of_room(), {0.1, 20.0}, {-0.5, 0.5}).value();
  for (double x = -2.7; x < 2.8; x += 0.25)
    for (double y = -1.7; y < 1.8; y += 0.25) EXPECT_EQ(cell_at(grid, x, y), Cell::kFree) << x << ' ' << y;
  int walls = 0;
  for (const Cell cell : grid.cells) walls += cell == Cell::kOccupied;
  EXPECT_GT(walls, 180);  // of 200 cells along the walls
  EXPECT_LT(walls, 420);
  EXPECT_EQ(cell_at(grid, 3.25, 0), Cell::kUnknown);
}

// A landmark above the band is no obstacle, and the ray to it is free only as long as it is within the band.
TEST(OccupancyGrid, UsesThePartsOfRaysWithinTheBand) {
  std::vector<Scan> scans;
  for (int i = 0; i < 4; ++i) scans.push_back({{0, 0, 1}, 1.0, {{{4, 0, 3}, 0.01}, {{2, 0, 1.2}, 0.01}}});
  scans.push_back({{0, 2, 1}, 1.0, {{{4, 2, 3}, 0.01}}});
  scans.push_back(scans.back());
  const OccupancyGrid grid = occupancy_grid(scans, {0.1, 20.0}, {-0.5, 0.5}).value();
  EXPECT_EQ(cell_at(grid, 0.5, 0.05), Cell::kFree);
  EXPECT_EQ(cell_at(grid, 2.05, 0.05), Cell::kOccupied);
  EXPECT_EQ(cell_at(grid, 0.95, 2.05), Cell::kFree);
  EXPECT_EQ(cell_at(grid, 1.05, 2.05), Cell::kUnknown);
}

TEST(OccupancyGrid, RejectsCellsThatAreTooSmall) {
  const auto grid = occupancy_grid(scans_of_room(), {1e-3, 20.0}, {-0.5, 0.5});  // 25 million cells
  ASSERT_FALSE(grid);
  EXPECT_EQ(grid.error().key, "--resolution");
}

// Reads image and description as the map server does: the first row of the image is the one with the largest y.
TEST(OccupancyGrid, IsAnImageWithItsDescription) {
  const OccupancyGrid grid = occupancy_grid(scans_of_room(), {0.1, 20.0}, {-0.5, 0.5}).value();
  std::istringstream pgm(grid_pgm(grid));
  std::string magic;
  int width = 0, height = 0, white = 0;
  pgm >> magic >> width >> height >> white;
  pgm.get();
  EXPECT_EQ(magic, "P5");
  EXPECT_EQ(white, 255);
  ASSERT_EQ(width, grid.width);
  ASSERT_EQ(height, grid.height);
  std::string pixels(static_cast<std::size_t>(width) * height, '\0');
  ASSERT_TRUE(pgm.read(pixels.data(), static_cast<std::streamsize>(pixels.size())));
  EXPECT_EQ(pgm.get(), EOF);
  constexpr double kOccupiedThreshold = 0.65, kFreeThreshold = 0.196;
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const auto value =
          static_cast<unsigned char>(pixels[static_cast<std::size_t>(height - 1 - row) * width + column]);
      const double occupied = (255 - value) / 255.0;
      const Cell cell = occupied > kOccupiedThreshold ? Cell::kOccupied
                        : occupied < kFreeThreshold   ? Cell::kFree
                                                      : Cell::kUnknown;
      ASSERT_EQ(cell, grid.at(column, row));
    }
  }
  const std::string yaml = grid_yaml(grid, "map.pgm", {"a comment"});
  for (const char* line : {"# a comment\n", "image: map.pgm\n", "mode: trinary\n", "resolution: 0.1\n", "negate: 0\n",
                           "occupied_thresh: 0.65\n", "free_thresh: 0.196\n"})
    EXPECT_NE(yaml.find(line), std::string::npos) << line;
}

TEST(Scans, GoFromTheCamerasToTheLandmarksInUprightAxes) {
  const ExportedMap map(synthetic::ring_rig(3));
  const std::vector<Scan> scans = scans_of(map.selection);
  ASSERT_EQ(scans.size(), map.images.images().size());
  const Eigen::Vector3d up = map.selection.T_upright_world.rotation().inverse() * Eigen::Vector3d::UnitZ();
  EXPECT_GT(up.dot(map.selection.world_from_rig(map.selection.keyframes[0]).matrix3() * -Eigen::Vector3d::UnitY()),
            0.9);
  // The scans are in order of keyframe and camera, as the images are.
  std::vector<std::vector<Eigen::Vector3d>> seen(scans.size());
  for (const LandmarkId l : map.selection.landmarks)
    for_each_keypoint(map.selection, l, [&](KeyframeId k, frame::KeypointRef r) {
      seen[static_cast<std::size_t>(map.images.of(k, r.camera.index()))].push_back(map.selection.T_upright_world *
                                                                                   map.map.landmark(l).position);
    });
  std::size_t rays = 0;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const MapImage& image = map.images.images()[i];
    const geometry::SE3 T_world_cam = map.map.cam_from_world(image.keyframe, CameraIndex(image.camera)).inverse();
    EXPECT_LT((scans[i].origin - map.selection.T_upright_world * T_world_cam.translation()).norm(), 1e-9);
    for (const Ray& ray : scans[i].rays) {
      EXPECT_TRUE(std::ranges::any_of(seen[i], [&](const auto& p) { return (p - ray.end).norm() < 1e-9; }));
      EXPECT_GT(ray.sigma, 0);
      EXPECT_TRUE(std::isfinite(ray.sigma));
    }
    rays += scans[i].rays.size();
  }
  EXPECT_GT(rays, 500u);
}

}  // namespace
}  // namespace bslam::map_export
