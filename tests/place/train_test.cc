#include "place/train.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "place/random_descriptors.h"
#include "place/vocabulary_bytes.h"
#include "place/word_vector.h"

namespace bslam::place {
namespace {

using feature::Descriptor;
using Images = std::vector<std::vector<Descriptor>>;

// 20 clusters in two distant groups of ten.
struct TwoGroups {
  std::vector<Descriptor> centre;
  Images images;  // image i contains the clusters c with c % 5 != i % 5

  explicit TwoGroups(Random& random) {
    for (int g = 0; g < 2; ++g) {
      const Descriptor group = random_descriptor(random);
      for (int c = 0; c < 10; ++c) centre.push_back(with_flips(group, 60, random));
    }
    images.resize(40);
    for (std::size_t i = 0; i < images.size(); ++i) {
      for (std::size_t c = 0; c < centre.size(); ++c) {
        for (int n = 0; n < 5 && c % 5 != i % 5; ++n) images[i].push_back(with_flips(centre[c], 8, random));
      }
    }
  }
};

VocabularyPtr train(const Images& images, const TrainingOptions& options, std::uint64_t seed, int threads = 1) {
  Random random(seed);
  ThreadPool pool(threads);
  return train_vocabulary(images, options, random, pool).value();
}

TEST(Train, SeparatesKnownClusters) {
  Random random(21);
  const TwoGroups world(random);
  const VocabularyPtr v = train(world.images, {.branching = 10, .levels = 3}, 1);
  std::vector<std::set<WordId>> words(world.centre.size());
  for (std::size_t c = 0; c < world.centre.size(); ++c) {
    for (int n = 0; n < 50; ++n) words[c].insert(v->word(with_flips(world.centre[c], 8, random)));
  }
  for (std::size_t a = 0; a < words.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      for (const WordId w : words[a]) EXPECT_FALSE(words[b].contains(w)) << "clusters " << a << " and " << b;
    }
  }
}

TEST(Train, FindsExactlyTheClustersOnOneLevel) {
  Random random(22);
  const TwoGroups world(random);
  const VocabularyPtr v = train(world.images, {.branching = 20, .levels = 1, .iterations = 30}, 3);
  EXPECT_EQ(v->size(), 20u);
  std::set<WordId> words;
  for (const Descriptor& c : world.centre) words.insert(v->word(c));
  EXPECT_EQ(words.size(), 20u);
  // Each cluster is contained in 32 of 40 images.
  for (const WordId w : words) EXPECT_NEAR(v->weight(w), std::log(41.0 / 32.0), 1e-6);
}

TEST(Train, WeightsAreInverseDocumentFrequencies) {
  Random random(23);
  const TwoGroups world(random);
  const VocabularyPtr v = train(world.images, {.branching = 4, .levels = 5}, 3);
  std::vector<std::set<std::size_t>> shown_by(v->size());
  for (std::size_t i = 0; i < world.images.size(); ++i) {
    for (const Descriptor& d : world.images[i]) shown_by[v->word(d).index()].insert(i);
  }
  for (std::size_t w = 0; w < v->size(); ++w) {
    ASSERT_FALSE(shown_by[w].empty());
    EXPECT_NEAR(v->weight(WordId(w)), std::log(41.0 / static_cast<double>(shown_by[w].size())), 1e-5);
  }
}

TEST(Train, DependsOnTheSeedAndNotOnThreads) {
  Random random(24);
  const TwoGroups world(random);
  const TrainingOptions options{.branching = 5, .levels = 4};
  const std::string once = serialise(*train(world.images, options, 1));
  EXPECT_EQ(serialise(*train(world.images, options, 1)), once);
  EXPECT_EQ(serialise(*train(world.images, options, 1, 3)), once);
  EXPECT_NE(serialise(*train(world.images, options, 2)), once);
}

TEST(Train, RespectsBranchingAndLevels) {
  Random random(25);
  const TwoGroups world(random);
  const VocabularyPtr v = train(world.images, {.branching = 3, .levels = 4}, 1);
  EXPECT_EQ(v->branching(), 3);
  EXPECT_EQ(v->levels(), 4);
  EXPECT_LE(v->size(), 81u);
  EXPECT_GT(v->size(), 27u);
}

TEST(Train, AcceptsFewOrEqualDescriptors) {
  Random random(26);
  const Descriptor a = random_descriptor(random), b = random_descriptor(random);
  const VocabularyPtr v = train({{a, a}, {}, {a, b}}, {.branching = 10, .levels = 5}, 1);
  EXPECT_EQ(v->size(), 2u);
  EXPECT_NEAR(v->weight(v->word(a)), std::log(4.0 / 2.0), 1e-6);
  EXPECT_NEAR(v->weight(v->word(b)), std::log(4.0 / 1.0), 1e-6);
}

TEST(Train, RejectsIndistinctDescriptors) {
  Random random(27);
  ThreadPool pool(1);
  const Descriptor a = random_descriptor(random);
  EXPECT_FALSE(train_vocabulary(Images{}, {}, random, pool).ok());
  EXPECT_FALSE(train_vocabulary(Images{{}, {}}, {}, random, pool).ok());
  EXPECT_FALSE(train_vocabulary(Images{{a, a}, {a}}, {}, random, pool).ok());
}

TEST(Train, ReportsItsProgress) {
  Random random(28);
  const TwoGroups world(random);
  ThreadPool pool(2);
  std::size_t last = 0, total = 0;
  const auto v = train_vocabulary(world.images, {.branching = 4, .levels = 2}, random, pool,
                                  [&](std::size_t done, std::size_t all) {
                                    EXPECT_GT(done, last);
                                    EXPECT_LE(done, all);
                                    last = done;
                                    total = all;
                                  });
  ASSERT_TRUE(v.ok());
  EXPECT_EQ(last, total);  // no node becomes a word before the last level
  EXPECT_EQ(total, 2u * 40u * 16u * 5u);
}

}  // namespace
}  // namespace bslam::place
