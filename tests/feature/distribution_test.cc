#include "feature/distribution.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <numeric>
#include <vector>

#include "base/random.h"

namespace bslam::feature {
namespace {

// At most one random corner per 3 x 3 block, in row-major order; the score depends on the position.
template <class Score>
std::vector<Corner> random_corners(const Region& region, double density, const Score& score) {
  Random random(4, "corners");
  std::vector<Corner> corners;
  for (int y = region.y; y < region.y + region.height; y += 3) {
    for (int x = region.x; x < region.x + region.width; x += 3) {
      if (random.uniform() > density) continue;
      corners.push_back({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                         static_cast<std::uint8_t>(score(x, y, random))});
    }
  }
  return corners;
}

const Region kRegion{18, 18, 600, 400};

int any_score(int, int, Random& random) { return 6 + static_cast<int>(random.below(200)); }

TEST(Distribution, DistributesOverLevelsByArea) {
  const std::array<double, 3> area{600, 300, 100};
  std::array<std::size_t, 3> counts{};
  distribute_over_levels(area, std::array<std::size_t, 3>{5000, 5000, 5000}, 1000, counts);
  EXPECT_EQ(counts, (std::array<std::size_t, 3>{600, 300, 100}));
  distribute_over_levels(area, std::array<std::size_t, 3>{200, 5000, 5000}, 1000, counts);
  EXPECT_EQ(counts, (std::array<std::size_t, 3>{200, 600, 200}));
  distribute_over_levels(area, std::array<std::size_t, 3>{10, 0, 7}, 1000, counts);
  EXPECT_EQ(counts, (std::array<std::size_t, 3>{10, 0, 7}));
  distribute_over_levels(area, std::array<std::size_t, 3>{5000, 5000, 5000}, 1, counts);
  EXPECT_EQ(counts[0] + counts[1] + counts[2], 1u);
}

TEST(Distribution, SuppressesNonMaximaOfANeighbourhood) {
  const std::vector<Corner> corners = random_corners(kRegion, 0.5, any_score);
  std::vector<std::uint32_t> ranked;
  Distribution(1).non_maximum_suppression(corners, kRegion, 9, ranked);
  const auto close = [&](const Corner& a, const Corner& b) {
    return std::abs(a.x - b.x) < 9 && std::abs(a.y - b.y) < 9;
  };
  std::vector<bool> kept(corners.size());
  for (std::size_t i = 0; i < ranked.size(); ++i) {
    kept[ranked[i]] = true;
    EXPECT_GE(corners[ranked[i > 0 ? i - 1 : 0]].score, corners[ranked[i]].score);
    for (std::size_t j = 0; j < i; ++j) ASSERT_FALSE(close(corners[ranked[i]], corners[ranked[j]]));
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {  // a suppressed corner is close to a better one
    if (kept[i]) continue;
    EXPECT_TRUE(std::any_of(ranked.begin(), ranked.end(), [&](std::uint32_t k) {
      return close(corners[i], corners[k]) && corners[k].score >= corners[i].score;
    }));
  }
}

std::vector<Corner> choose(const std::vector<Corner>& corners, std::size_t wanted, int strong = 20) {
  Distribution distribution(wanted);
  std::vector<std::uint32_t> ranked;
  std::vector<Corner> chosen;
  distribution.non_maximum_suppression(corners, kRegion, 5, ranked);
  distribution.choose(corners, ranked, kRegion, wanted, strong, chosen);
  return chosen;
}

TEST(Distribution, SelectsTheWantedNumberInRowMajorOrder) {
  const std::vector<Corner> corners = random_corners(kRegion, 0.3, any_score);
  for (const std::size_t wanted : {0u, 1u, 7u, 100u, 400u}) {
    const std::vector<Corner> chosen = choose(corners, wanted);
    EXPECT_EQ(chosen.size(), wanted);
    EXPECT_TRUE(std::is_sorted(chosen.begin(), chosen.end(),
                               [](const Corner& a, const Corner& b) { return a.y != b.y ? a.y < b.y : a.x < b.x; }));
  }
  EXPECT_TRUE(choose({}, 100).empty());
}

TEST(Distribution, RegionOfStrongCornersDoesNotTakeAll) {
  const auto score = [](int x, int y, Random& random) {
    return x < 200 && y < 150 ? 120 + static_cast<int>(random.below(100)) : 25 + static_cast<int>(random.below(30));
  };
  const std::vector<Corner> chosen = choose(random_corners(kRegion, 0.4, score), 300);
  const auto strong = std::count_if(chosen.begin(), chosen.end(), [](const Corner& c) { return c.score >= 120; });
  EXPECT_EQ(chosen.size(), 300u);
  EXPECT_LT(strong, 60);  // 30 by area, although it contains all of the best corners
}

TEST(Distribution, WeakCornersAreTakenOnlyWhereStrongOnesAreFew) {
  // The left half has many strong corners, the right half only weak ones.
  const auto score = [](int x, int, Random& random) { return (x < 318 ? 60 : 6) + static_cast<int>(random.below(10)); };
  const std::vector<Corner> corners = random_corners(kRegion, 0.5, score);
  const auto count_weak = [](const std::vector<Corner>& chosen) {
    return std::count_if(chosen.begin(), chosen.end(), [](const Corner& c) { return c.score <= 20; });
  };
  EXPECT_NEAR(static_cast<double>(count_weak(choose(corners, 200))), 100.0, 25.0);  // not more than the equal number
  EXPECT_EQ(count_weak(choose(corners, 200, 5)), count_weak(choose(corners, 200, 255)));
}

}  // namespace
}  // namespace bslam::feature
