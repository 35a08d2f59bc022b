#include "simulator/route.h"

#include <gtest/gtest.h>

#include <cmath>

namespace bslam::simulator {
namespace {

TEST(StreetGrid, HasBlocksAndStreetsOfTheGivenSizes) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const StreetGrid grid = make_street_grid(seed);
    for (const std::vector<Street>& streets : grid.streets) {
      ASSERT_EQ(streets.size(), StreetGrid::kStreets);
      for (std::size_t i = 0; i < streets.size(); ++i) {
        EXPECT_GE(streets[i].half_width, 7.0);
        EXPECT_LE(streets[i].half_width, 9.0);
        if (i == 0) continue;
        const double block =
            streets[i].centre - streets[i].half_width - streets[i - 1].centre - streets[i - 1].half_width;
        EXPECT_GE(block, 39.9);
        EXPECT_LE(block, 90.1);
      }
      EXPECT_LT(streets.back().centre - streets.front().centre, 1400);
    }
  }
}

TEST(Route, HasTheRequestedLength) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const StreetGrid grid = make_street_grid(seed);
    for (const double length : {200.0, 250.0, 400.0, 1000.0, 5000.0, 100'000.0})
      EXPECT_NEAR(make_route(grid, length, seed).length() / length, 1.0, 0.04) << length << ", seed " << seed;
  }
}

TEST(Route, IsClosedAndSmooth) {
  const ClosedPath route = make_route(make_street_grid(2), 3000, 2);
  EXPECT_LT((route(0) - route(route.length())).norm(), 1e-9);
  for (double arc = 0; arc < route.length(); arc += 0.5) {  // the sharpest corners have a radius of 7.5 m
    EXPECT_GT(route.tangent(arc, 0.5).dot(route.tangent(arc + 0.5, 0.5)), std::cos(0.5 / 6.0)) << arc;
  }
}

TEST(Route, LeadsAlongStreetsOnTheirRight) {
  const StreetGrid grid = make_street_grid(3);
  const ClosedPath route = make_route(grid, 2000, 3);
  const auto nearest = [](const std::vector<Street>& streets, double at) {
    double least = 1e9;
    for (const Street& s : streets) least = std::abs(at - s.centre) < std::abs(least) ? at - s.centre : least;
    return least;
  };
  for (double arc = 0; arc < route.length(); arc += 1.0) {
    const Vector2d p = route(arc), ahead = route.tangent(arc, 0.5);
    if (std::abs(ahead.x()) > 0.9999) {
      EXPECT_NEAR(nearest(grid.streets[1], p.y()), ahead.x() > 0 ? -1.0 : 1.0, 0.05) << arc;
    } else if (std::abs(ahead.y()) > 0.9999) {
      EXPECT_NEAR(nearest(grid.streets[0], p.x()), ahead.y() > 0 ? 1.0 : -1.0, 0.05) << arc;
    }
  }
}

TEST(Route, ReturnsToStreetsInTheSameDirection) {
  const ClosedPath route = make_route(make_street_grid(1), 5000, 1);
  int revisits = 0;
  bool before = false;
  for (double arc = 0; arc < route.length() - 100; arc += 2) {
    bool again = false;
    for (double earlier = 0; earlier < arc - 100 && !again; earlier += 2)
      again =
          (route(arc) - route(earlier)).norm() < 1.5 && route.tangent(arc, 0.5).dot(route.tangent(earlier, 0.5)) > 0.95;
    revisits += again && !before ? 1 : 0;
    before = again;
  }
  EXPECT_GE(revisits, 5);
}

TEST(Route, IsDeterminedByItsSeed) {
  const StreetGrid grid = make_street_grid(1);
  const ClosedPath a = make_route(grid, 1500, 4), b = make_route(grid, 1500, 4), c = make_route(grid, 1500, 5);
  EXPECT_EQ(a(700), b(700));
  EXPECT_GT((a(700) - c(700)).norm(), 1.0);
}

}  // namespace
}  // namespace bslam::simulator
