#include "feature/descriptor_matching.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/random.h"

namespace bslam::feature {
namespace {

Descriptor flipped(Descriptor d, int bits) {  // the first `bits` bits
  for (int b = 0; b < bits; ++b) d[static_cast<std::size_t>(b / 64)] ^= std::uint64_t{1} << (b % 64);
  return d;
}

std::vector<Descriptor> random_descriptors(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Descriptor> out(count);
  for (Descriptor& d : out) d = {random.next(), random.next(), random.next(), random.next()};
  return out;
}

constexpr auto kAll = [](std::size_t) { return true; };
constexpr auto kAnyPair = [](std::size_t, std::size_t) { return true; };

TEST(NearestDescriptor, FindsTheNearestAndTheDistanceOfTheSecond) {
  const Descriptor d = random_descriptors(1, 1)[0];
  const std::vector<Descriptor> among = {flipped(d, 30), flipped(d, 10), flipped(d, 20), flipped(d, 10)};
  const NearestDescriptor found = nearest_descriptor(d, among, kAll);
  EXPECT_EQ(found.index, 1u);  // the first of two equal ones
  EXPECT_EQ(found.distance, 10);
  EXPECT_EQ(found.second, 10);
  const NearestDescriptor without = nearest_descriptor(d, among, [](std::size_t i) { return i != 1 && i != 3; });
  EXPECT_EQ(without.index, 2u);
  EXPECT_EQ(without.distance, 20);
  EXPECT_EQ(without.second, 30);
}

TEST(NearestDescriptor, IsClearIfCloseAndUnambiguous) {
  EXPECT_TRUE((NearestDescriptor{0, 40, 51}.is_clear(40, 0.8)));
  EXPECT_FALSE((NearestDescriptor{0, 41, 60}.is_clear(40, 0.8)));
  EXPECT_FALSE((NearestDescriptor{0, 40, 50}.is_clear(40, 0.8)));
  EXPECT_FALSE(nearest_descriptor({}, {}, kAll).is_clear(256, 0.9));
}

TEST(MutualMatches, FindsThePairsOfAShuffledCopy) {
  const std::vector<Descriptor> a = random_descriptors(200, 2);
  std::vector<Descriptor> b;
  for (std::size_t i = 0; i < a.size(); ++i) b.push_back(flipped(a[(i * 77) % a.size()], 15));
  const auto matches = mutual_matches(a, b, 50, 0.8, kAnyPair);
  ASSERT_EQ(matches.size(), a.size());
  for (const DescriptorMatch& m : matches) EXPECT_EQ((m.b.index() * 77) % a.size(), m.a.index());
  EXPECT_TRUE(std::ranges::is_sorted(matches, {}, &DescriptorMatch::a));
}

TEST(MutualMatches, IgnoresMatchesThatAreNotMutualOrNotAllowed) {
  const std::vector<Descriptor> all = random_descriptors(3, 3);
  const std::vector<Descriptor> a = {all[0], flipped(all[0], 40), all[1]}, b = {flipped(all[0], 2), all[1], all[2]};
  const auto matches = mutual_matches(a, b, 50, 0.9, kAnyPair);
  ASSERT_EQ(matches.size(), 2u);  // a[1] is nearest to b[0], which is nearer to a[0]
  EXPECT_EQ(matches[0].a, KeypointIndex(0));
  EXPECT_EQ(matches[1].a, KeypointIndex(2));
  const auto others = mutual_matches(a, b, 50, 0.9, [](std::size_t i, std::size_t) { return i != 0; });
  ASSERT_EQ(others.size(), 2u);
  EXPECT_EQ(others[0].a, KeypointIndex(1));
}

}  // namespace
}  // namespace bslam::feature
