#include "place/vocabulary.h"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "feature/brief_pattern.h"
#include "feature/hamming.h"
#include "place/content_hash.h"
#include "place/random_descriptors.h"

namespace bslam::place {
namespace {

using feature::Descriptor;

// The definition of the descent, computed from the content only.
WordId word_by_definition(const VocabularyContent& c, const Descriptor& d) {
  std::size_t node = 0;
  while (c.child_count[node] > 0) {
    const std::size_t first =
        1 + std::accumulate(c.child_count.begin(), c.child_count.begin() + static_cast<std::ptrdiff_t>(node),
                            std::size_t{0});
    std::size_t best = first;
    for (std::size_t child = first; child < first + c.child_count[node]; ++child) {
      if (feature::hamming(d, c.descriptor[child - 1]) < feature::hamming(d, c.descriptor[best - 1])) best = child;
    }
    node = best;
  }
  return WordId(static_cast<std::size_t>(
      std::count(c.child_count.begin(), c.child_count.begin() + static_cast<std::ptrdiff_t>(node), std::uint8_t{0})));
}

TEST(Vocabulary, FindsTheWordByGreedyDescent) {
  Random random(1);
  for (int tree = 0; tree < 6; ++tree) {
    const VocabularyPtr v = random_vocabulary(2 + tree * 2, 4 - tree / 3, random);
    ASSERT_GT(v->size(), 4u);
    std::vector<Descriptor> descriptors;
    for (int i = 0; i < 333; ++i) descriptors.push_back(random_descriptor(random));
    std::vector<WordId> words(descriptors.size());
    v->words(descriptors, words);
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      const WordId expected = word_by_definition(v->content(), descriptors[i]);
      ASSERT_EQ(v->word(descriptors[i]), expected);
      ASSERT_EQ(words[i], expected);
    }
  }
}

TEST(Vocabulary, FindsWordsOfAnyNumberOfDescriptors) {
  Random random(2);
  const VocabularyPtr v = random_vocabulary(10, 3, random);
  for (const std::size_t count : {0u, 1u, 31u, 32u, 33u, 64u}) {
    std::vector<Descriptor> descriptors(count);
    for (Descriptor& d : descriptors) d = random_descriptor(random);
    std::vector<WordId> words(count);
    v->words(descriptors, words);
    for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(words[i], v->word(descriptors[i]));
  }
}

TEST(Vocabulary, SelectsTheFirstChildOnTies) {
  VocabularyContent c;
  c.branching = 3;
  c.levels = 1;
  c.child_count = {3, 0, 0, 0};
  c.descriptor = {Descriptor{3, 0, 0, 0}, Descriptor{1, 0, 0, 0}, Descriptor{2, 0, 0, 0}};
  c.weight = {1, 1, 1};
  const VocabularyPtr v = Vocabulary::make(c).value();
  EXPECT_EQ(v->word(Descriptor{0, 0, 0, 0}), WordId(1));  // Hamming distances 2, 1, 1
  EXPECT_EQ(v->word(Descriptor{1, 0, 0, 1}), WordId(1));
  EXPECT_EQ(v->word(Descriptor{3, 0, 0, 0}), WordId(0));
}

TEST(Vocabulary, IdIdentifiesTheContent) {
  Random random(3);
  const VocabularyContent content = random_content(5, 3, random);
  const std::uint64_t id = Vocabulary::make(content).value()->id();
  EXPECT_EQ(Vocabulary::make(content).value()->id(), id);
  const auto changed = [&](auto change) {
    VocabularyContent c = content;
    change(c);
    return Vocabulary::make(c).value()->id();
  };
  EXPECT_NE(changed([](VocabularyContent& c) { c.kind += "2"; }), id);
  EXPECT_NE(changed([](VocabularyContent& c) { ++c.branching; }), id);
  EXPECT_NE(changed([](VocabularyContent& c) { ++c.levels; }), id);
  EXPECT_NE(changed([](VocabularyContent& c) { c.descriptor[3][2] ^= 1; }), id);
  EXPECT_NE(changed([](VocabularyContent& c) { std::swap(c.descriptor[0], c.descriptor[1]); }), id);
  EXPECT_NE(changed([](VocabularyContent& c) { c.weight.back() += 0.5f; }), id);
}

TEST(Vocabulary, RejectsInconsistentContent) {
  VocabularyContent good;
  good.branching = 2;
  good.levels = 2;
  good.child_count = {2, 2, 0, 0, 0};
  good.descriptor.resize(4);
  good.weight = {1, 1, 1};
  ASSERT_TRUE(Vocabulary::make(good).ok());
  const auto rejected = [&](auto change) {
    VocabularyContent c = good;
    change(c);
    return !Vocabulary::make(c).ok();
  };
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.kind = ""; }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.kind = "a b"; }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.kind = std::string(65, 'k'); }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.branching = 1; }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.branching = kMaxBranching + 1; }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.levels = 1; }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.levels = kMaxLevels + 1; }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.child_count = {}; }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.child_count = {0, 2, 2, 0, 0}; }));
  // node 3 is not the child of any node
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.child_count = {2, 0, 0, 2, 0}; }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.child_count = {2, 3, 0, 0, 0}; }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.child_count = {2, 2, 2, 0, 0}; }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.child_count = {1, 2, 0, 0, 0}; }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.descriptor.pop_back(); }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.weight.pop_back(); }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.weight.push_back(1); }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.weight[1] = -1; }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.weight[1] = std::numeric_limits<float>::infinity(); }));
  EXPECT_TRUE(rejected([](VocabularyContent& c) { c.weight[1] = std::numeric_limits<float>::quiet_NaN(); }));
}

// The kind identifies the meaning of the descriptor bits. A change of the BRIEF pattern requires a new kDescriptorKind,
// a newly trained vocabulary, and the new hash here; otherwise words with another meaning would be looked up.
TEST(Vocabulary, KindIdentifiesTheBriefPattern) {
  ContentHash hash;
  for (const feature::BinaryTest& t : feature::make_brief_pattern()) {
    for (const int v : {t.x1, t.y1, t.x2, t.y2}) hash.add(static_cast<std::uint64_t>(v + 128));
  }
  EXPECT_EQ(kDescriptorKind, "orb256-bslam");
  EXPECT_EQ(hash.value(), 6105728185969473080ull);
}

}  // namespace
}  // namespace bslam::place
