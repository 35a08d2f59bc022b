#include "place/shipped_vocabulary.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "place/random_descriptors.h"
#include "place/vocabulary_bytes.h"

namespace bslam::place {
namespace {

TEST(ShippedVocabulary, MatchesTheDescriptorKind) {
  const auto v = shipped_vocabulary();
  ASSERT_TRUE(v.ok()) << v.error().message();
  EXPECT_EQ((*v)->kind(), kDescriptorKind);
  EXPECT_EQ((*v)->branching(), 10);
  EXPECT_EQ((*v)->levels(), 5);
  EXPECT_GT((*v)->size(), 50000u);
  EXPECT_LE(shipped_vocabulary_bytes().size(), 5000000u);
}

// A word carries log2(number of words) bits if all words are equally likely. Descriptors scattered around the tree's
// own centres must come close to that and use most of the words.
TEST(ShippedVocabulary, DistributesDescriptorsOverItsWords) {
  const VocabularyPtr v = shipped_vocabulary().value();
  Random random(41);
  const auto& centres = v->content().descriptor;
  std::vector<feature::Descriptor> descriptors(200000);
  for (auto& d : descriptors) {
    d = with_flips(centres[random.below(static_cast<std::uint32_t>(centres.size()))], 25, random);
  }
  std::vector<WordId> words(descriptors.size());
  v->words(descriptors, words);
  std::vector<double> count(v->size(), 0.0);
  for (const WordId w : words) ++count[w.index()];
  double entropy = 0;
  std::size_t used = 0;
  for (const double n : count) {
    if (n == 0) continue;
    ++used;
    const double p = n / static_cast<double>(words.size());
    entropy -= p * std::log2(p);
  }
  EXPECT_GT(entropy, std::log2(static_cast<double>(v->size())) - 2.5);
  EXPECT_GT(used, v->size() / 2);
  EXPECT_LT(*std::max_element(count.begin(), count.end()), 0.005 * static_cast<double>(words.size()));
}

}  // namespace
}  // namespace bslam::place
