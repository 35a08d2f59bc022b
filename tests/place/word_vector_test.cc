#include "place/word_vector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "place/random_descriptors.h"

namespace bslam::place {
namespace {

std::vector<WordId> random_words(const Vocabulary& v, int count, Random& random) {
  std::vector<WordId> words;
  for (int i = 0; i < count; ++i)
    words.push_back(WordId(std::size_t{random.below(static_cast<std::uint32_t>(v.size()))}));
  return words;
}

// 1 - 0.5 |a - b|_1, computed over all words.
double score_by_definition(const WordVector& a, const WordVector& b) {
  std::map<WordId, double> difference;
  for (const WeightedWord& w : a.words()) difference[w.word] += w.weight;
  for (const WeightedWord& w : b.words()) difference[w.word] -= w.weight;
  double sum = 0;
  for (const auto& [word, d] : difference) sum += std::abs(d);
  return 1 - 0.5 * sum;
}

class WordVectorTest : public testing::Test {
 protected:
  Random random_{7};
  VocabularyPtr vocabulary_ = random_vocabulary(6, 3, random_);
};

TEST_F(WordVectorTest, ComputesTfIdfWeights) {
  const std::vector<WordId> words{WordId(4), WordId(2), WordId(4), WordId(), WordId(9)};
  const WordVector v(*vocabulary_, words);
  ASSERT_EQ(v.size(), 3u);
  const double sum =
      vocabulary_->weight(WordId(2)) + 2 * vocabulary_->weight(WordId(4)) + vocabulary_->weight(WordId(9));
  EXPECT_EQ(v.words()[0].word, WordId(2));
  EXPECT_EQ(v.words()[1].word, WordId(4));
  EXPECT_EQ(v.words()[2].word, WordId(9));
  EXPECT_NEAR(v.words()[0].weight, vocabulary_->weight(WordId(2)) / sum, 1e-6);
  EXPECT_NEAR(v.words()[1].weight, 2 * vocabulary_->weight(WordId(4)) / sum, 1e-6);
}

TEST_F(WordVectorTest, SumsToOneInAnyOrder) {
  std::vector<WordId> words = random_words(*vocabulary_, 500, random_);
  const WordVector v(*vocabulary_, words);
  double sum = 0;
  for (const WeightedWord& w : v.words()) sum += w.weight;
  EXPECT_NEAR(sum, 1.0, 1e-5);
  std::reverse(words.begin(), words.end());
  const WordVector reversed(*vocabulary_, words);
  ASSERT_EQ(reversed.size(), v.size());
  for (std::size_t i = 0; i < v.size(); ++i) EXPECT_EQ(reversed.words()[i].weight, v.words()[i].weight);
}

TEST_F(WordVectorTest, IsEmptyWithoutWords) {
  EXPECT_TRUE(WordVector(*vocabulary_, {}).empty());
  EXPECT_TRUE(WordVector(*vocabulary_, std::vector<WordId>(3)).empty());
}

TEST_F(WordVectorTest, IgnoresWordsOfZeroWeight) {
  VocabularyContent c = vocabulary_->content();
  c.weight[1] = 0;
  const VocabularyPtr stopped = Vocabulary::make(c).value();
  EXPECT_TRUE(WordVector(*stopped, std::vector<WordId>{WordId(1)}).empty());
  EXPECT_EQ(WordVector(*stopped, std::vector<WordId>{WordId(1), WordId(3)}).size(), 1u);
}

TEST_F(WordVectorTest, ScoresByTheL1Distance) {
  for (int i = 0; i < 50; ++i) {
    const WordVector a(*vocabulary_, random_words(*vocabulary_, 1 + i, random_));
    const WordVector b(*vocabulary_, random_words(*vocabulary_, 60, random_));
    const double score = l1_score(a, b);
    EXPECT_NEAR(score, score_by_definition(a, b), 1e-6);
    EXPECT_EQ(score, l1_score(b, a));
    EXPECT_GE(score, 0.0);
    EXPECT_LE(score, 1.0);
  }
}

TEST_F(WordVectorTest, ScoresOneForEqualAndZeroForDisjoint) {
  const WordVector a(*vocabulary_, random_words(*vocabulary_, 80, random_));
  EXPECT_NEAR(l1_score(a, a), 1.0, 1e-6);
  const WordVector low(*vocabulary_, std::vector<WordId>{WordId(0), WordId(2)});
  const WordVector high(*vocabulary_, std::vector<WordId>{WordId(1), WordId(3)});
  EXPECT_EQ(l1_score(low, high), 0.0);
  EXPECT_EQ(l1_score(a, WordVector()), 0.0);
  EXPECT_EQ(l1_score(WordVector(), WordVector()), 0.0);
}

}  // namespace
}  // namespace bslam::place
