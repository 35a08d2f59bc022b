#include "simulator/building.h"

#include <gtest/gtest.h>

namespace bslam::simulator {
namespace {

TEST(Building, IsDeterminedByItsSeed) {
  const Building a = make_building(3), b = make_building(3), c = make_building(4);
  ASSERT_EQ(a.surfaces.size(), b.surfaces.size());
  for (std::size_t i = 0; i < a.surfaces.size(); ++i) {
    EXPECT_EQ(a.surfaces[i].origin, b.surfaces[i].origin);
    EXPECT_EQ(a.surfaces[i].texture.seed, b.surfaces[i].texture.seed);
  }
  EXPECT_NE(a.surfaces.size(), c.surfaces.size());
}

TEST(Building, ConsistsOfRectangles) {
  const Building b = make_building(1);
  EXPECT_EQ(b.rooms.size(), 7u);
  for (const Surface& s : b.surfaces) {
    EXPECT_NEAR(s.u.dot(s.v), 0.0, 1e-9);
    EXPECT_GT(s.u.cross(s.v).norm(), 0.0);
  }
}

TEST(Building, HasATourThroughSixRooms) {
  const Building b = make_building(1);
  std::size_t visited = 0;
  for (const Room& room : b.rooms) {
    for (const Vector2d& p : b.tour) {
      if ((p.array() > room.low.array()).all() && (p.array() < room.high.array()).all()) {
        ++visited;
        break;
      }
    }
  }
  EXPECT_EQ(visited, 6u);
  for (std::size_t i = 0; i < b.tour.size(); ++i) {
    EXPECT_LT((b.tour[(i + 1) % b.tour.size()] - b.tour[i]).norm(), 2 * Building::kTourStep);
  }
}

TEST(Surface, ComputesTheDistanceOfAPoint) {
  std::vector<Surface> one(1);
  one[0].origin = Vector3d(0, 0, 1);
  one[0].u = Vector3d(2, 0, 0);
  one[0].v = Vector3d(0, 2, 0);
  EXPECT_NEAR(distance_to_surfaces(one, {1, 1, 4}), 3.0, 1e-12);
  EXPECT_NEAR(distance_to_surfaces(one, {5, 1, 5}), 5.0, 1e-12);
}

TEST(Surface, BoxesFaceOutwards) {
  std::vector<Surface> faces;
  const Box box{{1, 2, 0.5}, {0.4, 0.6, 0.8}, 0.7};
  add_box(faces, box, {}, {});
  ASSERT_EQ(faces.size(), 6u);
  const Vector3d centre = box.bottom_centre + Vector3d(0, 0, 0.4);
  for (const Surface& f : faces) {
    const Vector3d middle = f.origin + 0.5 * (f.u + f.v);
    EXPECT_GT((middle - centre).dot(f.u.cross(f.v)), 0.0);
  }
}

}  // namespace
}  // namespace bslam::simulator
