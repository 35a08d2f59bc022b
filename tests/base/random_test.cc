#include "base/random.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <set>
#include <vector>

namespace bslam {
namespace {

std::vector<std::uint64_t> draws(Random random, int count) {
  std::vector<std::uint64_t> out;
  for (int i = 0; i < count; ++i) out.push_back(random.next());
  return out;
}

TEST(Random, IsDeterministicForSeedStageAndFrame) {
  EXPECT_EQ(draws(Random(1, "track", 7), 100), draws(Random(1, "track", 7), 100));
}

TEST(Random, DependsOnSeedStageAndFrame) {
  std::set<std::uint64_t> first;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    for (const char* stage : {"", "a", "b", "ab", "ba"}) {
      for (std::uint64_t frame = 0; frame < 10; ++frame) first.insert(Random(seed, stage, frame).next());
    }
  }
  EXPECT_EQ(first.size(), 10u * 5u * 10u);
}

// Reference values from another implementation of xoshiro256** and splitmix64 (Blackman and Vigna): the numbers
// generated from a seed never change between releases, compilers or machines.
TEST(Random, MatchesTheReferenceGenerator) {
  Random random(42, "stage", 3);
  EXPECT_EQ(random.next(), 0x53378ba9305f38f5ull);
  EXPECT_EQ(random.next(), 0xd912c71c3ef18156ull);
  EXPECT_EQ(random.next(), 0xd7b8d41f4bd16d68ull);
}

TEST(Random, UniformIsUniformOnTheUnitInterval) {
  Random random(5);
  constexpr int kDraws = 100000, kBins = 20;
  std::array<int, kBins> bins{};
  double sum = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double u = random.uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    ++bins[static_cast<std::size_t>(u * kBins)];
    sum += u;
  }
  double chi2 = 0;
  for (const int n : bins) chi2 += std::pow(n - kDraws / kBins, 2) / (kDraws / kBins);
  EXPECT_LT(chi2, 43.8);  // 99.9 % quantile of chi-square with 19 degrees of freedom
  EXPECT_NEAR(sum / kDraws, 0.5, 0.005);
}

TEST(Random, BelowIsUniform) {
  Random random(6);
  constexpr int kDraws = 70000;
  std::array<int, 7> counts{};
  for (int i = 0; i < kDraws; ++i) ++counts.at(random.below(7));
  double chi2 = 0;
  for (const int n : counts) chi2 += std::pow(n - kDraws / 7.0, 2) / (kDraws / 7.0);
  EXPECT_LT(chi2, 22.5);  // 99.9 % quantile with 6 degrees of freedom
  EXPECT_EQ(random.below(1), 0u);
}

TEST(Random, ThreeOfThreeAreAllOfThemInEveryOrder) {
  Random random(5);
  std::map<std::array<std::uint32_t, 3>, int> count;
  for (int i = 0; i < 6000; ++i) ++count[random.three_below(3)];
  ASSERT_EQ(count.size(), 6u);
  for (const auto& [order, n] : count) {
    EXPECT_EQ((std::set<std::uint32_t>(order.begin(), order.end()).size()), 3u);
    EXPECT_NEAR(n, 1000, 150);
  }
}

TEST(Random, UniformStaysWithinItsBounds) {
  Random random(7);
  for (int i = 0; i < 1000; ++i) {
    const double u = random.uniform(-3.0, -1.0);
    EXPECT_GE(u, -3.0);
    EXPECT_LT(u, -1.0);
  }
}

TEST(Random, NormalHasMeanZeroAndDeviationOne) {
  Random random(8);
  constexpr int kDraws = 100000;
  double sum = 0, squares = 0, fourth = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.normal();
    ASSERT_TRUE(std::isfinite(x));
    sum += x;
    squares += x * x;
    fourth += x * x * x * x;
  }
  EXPECT_NEAR(sum / kDraws, 0.0, 0.015);
  EXPECT_NEAR(squares / kDraws, 1.0, 0.02);
  EXPECT_NEAR(fourth / kDraws, 3.0, 0.15);
}

}  // namespace
}  // namespace bslam
