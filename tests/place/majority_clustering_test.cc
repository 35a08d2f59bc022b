#include "place/majority_clustering.h"

#include <gtest/gtest.h>

#include <set>

#include "feature/hamming.h"
#include "place/random_descriptors.h"

namespace bslam::place {
namespace {

using feature::Descriptor;

TEST(Majority, SetsTheBitsOfTheMajority) {
  Random random(5);
  for (const std::size_t count : {1u, 2u, 7u, 254u, 255u, 256u, 257u, 1000u}) {
    std::vector<Descriptor> descriptors(count);
    for (Descriptor& d : descriptors) d = random_descriptor(random);
    const Descriptor tie = random_descriptor(random);
    const Descriptor result = majority(descriptors, tie);
    for (std::size_t bit = 0; bit < 256; ++bit) {
      const auto bit_of = [bit](const Descriptor& d) { return (d[bit / 64] >> (bit % 64)) & 1; };
      std::size_t set = 0;
      for (const Descriptor& d : descriptors) set += bit_of(d);
      const std::uint64_t expected = 2 * set == count ? bit_of(tie) : static_cast<std::uint64_t>(2 * set > count);
      ASSERT_EQ(bit_of(result), expected) << count << " descriptors, bit " << bit;
    }
  }
}

TEST(MajorityClustering, SeparatesDistantClusters) {
  Random random(6);
  std::vector<Descriptor> truth, descriptors;
  for (int c = 0; c < 10; ++c) truth.push_back(random_descriptor(random));
  for (int i = 0; i < 1000; ++i) descriptors.push_back(with_flips(truth[static_cast<std::size_t>(i % 10)], 20, random));
  const Clusters clusters = cluster_by_majority(descriptors, 10, 12, random);
  ASSERT_EQ(clusters.centre.size(), 10u);
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    EXPECT_EQ(clusters.of[i], clusters.of[i % 10]);
    EXPECT_EQ(clusters.centre[clusters.of[i]],
              truth[i % 10]);  // flipping a fifth of the bits of a hundred members changes no majority
  }
}

TEST(MajorityClustering, AssignsEveryMemberToItsNearestCentre) {
  Random random(8);
  std::vector<Descriptor> descriptors(700);
  for (Descriptor& d : descriptors) d = random_descriptor(random);
  for (const int iterations : {1, 3, 100}) {
    const Clusters clusters = cluster_by_majority(descriptors, 9, iterations, random);
    std::set<int> used;
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      std::size_t nearest = 0;
      for (std::size_t c = 1; c < clusters.centre.size(); ++c) {
        if (feature::hamming(descriptors[i], clusters.centre[c]) <
            feature::hamming(descriptors[i], clusters.centre[nearest]))
          nearest = c;
      }
      ASSERT_EQ(clusters.of[i], nearest);
      used.insert(clusters.of[i]);
    }
    EXPECT_EQ(used.size(), clusters.centre.size());  // no cluster is empty
  }
}

TEST(MajorityClustering, CreatesFewerClustersFromFewDescriptors) {
  Random random(9);
  const Descriptor a = random_descriptor(random), b = random_descriptor(random);
  EXPECT_EQ(cluster_by_majority(std::vector{a}, 10, 5, random).centre, std::vector{a});
  EXPECT_EQ(cluster_by_majority(std::vector{a, a, a}, 10, 5, random).centre, std::vector{a});
  const Clusters two = cluster_by_majority(std::vector{a, b, a, b, b}, 10, 5, random);
  EXPECT_EQ(std::set<Descriptor>(two.centre.begin(), two.centre.end()), (std::set<Descriptor>{a, b}));
}

}  // namespace
}  // namespace bslam::place
