#include "place/inverted_index.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "place/random_descriptors.h"

namespace bslam::place {
namespace {

using Counts = std::vector<std::pair<KeyframeId, int>>;

Counts counts(const std::vector<CommonWords>& result) {
  Counts out;
  for (const CommonWords& c : result) out.emplace_back(c.keyframe, c.count);
  return out;
}

class InvertedIndexTest : public testing::Test {
 protected:
  std::shared_ptr<const WordVector> vector_of(std::vector<WordId> words) {
    return std::make_shared<const WordVector>(*vocabulary_, words);
  }
  std::shared_ptr<const WordVector> random_vector(int count) {
    std::vector<WordId> words;
    for (int i = 0; i < count; ++i)
      words.push_back(WordId(std::size_t{random_.below(static_cast<std::uint32_t>(vocabulary_->size()))}));
    return vector_of(words);
  }

  // Compares every keyframe with the query, word by word.
  std::vector<CommonWords> query_by_definition(const WordVector& words) const {
    std::vector<CommonWords> result;
    for (const auto& [keyframe, vector] : held_) {
      std::set<WordId> own;
      for (const WeightedWord& w : vector->words()) own.insert(w.word);
      int count = 0;
      for (const WeightedWord& w : words.words()) count += static_cast<int>(own.count(w.word));
      if (count > 0) result.push_back({keyframe, count, l1_score(words, *vector)});
    }
    return result;
  }

  Random random_{11};
  VocabularyPtr vocabulary_ = random_vocabulary(8, 3, random_);
  std::map<KeyframeId, std::shared_ptr<const WordVector>> held_;
};

TEST_F(InvertedIndexTest, SeveralKeyframesAddedAtOnceAreThoseAddedOneByOne) {
  InvertedIndex index;
  for (int id = 10; id < 60; id += 5) {
    held_[KeyframeId(id)] = random_vector(20);
    index.add(KeyframeId(id), held_[KeyframeId(id)]);
  }
  std::vector<InvertedIndex::Entry> entries;  // between, before and after those in the index; one has no words
  for (int id = 1; id < 80; id += 3) {
    if (index.contains(KeyframeId(id))) continue;
    held_[KeyframeId(id)] = random_vector(id == 40 ? 0 : 20);
    entries.push_back({KeyframeId(id), held_[KeyframeId(id)]});
  }
  index.add(entries);
  EXPECT_EQ(index.size(), held_.size());
  for (int n = 0; n < 50; ++n) {
    const auto query = random_vector(20);
    ASSERT_EQ(index.query(*query), query_by_definition(*query));
  }
  for (const InvertedIndex::Entry& e : entries) EXPECT_EQ(index.words_of(e.keyframe), e.words);
}

TEST_F(InvertedIndexTest, AgreesWithAnExhaustiveComparison) {
  InvertedIndex index;
  for (int step = 0; step < 300; ++step) {
    const KeyframeId keyframe(static_cast<int>(random_.below(120)));
    if (index.contains(keyframe)) {
      index.remove(keyframe);
      held_.erase(keyframe);
    } else {
      const auto words = random_vector(static_cast<int>(random_.below(25)));
      index.add(keyframe, words);
      held_[keyframe] = words;
      EXPECT_EQ(index.words_of(keyframe), words);
    }
    ASSERT_EQ(index.size(), held_.size());
    const auto query = random_vector(20);
    ASSERT_EQ(index.query(*query), query_by_definition(*query));
  }
}

TEST_F(InvertedIndexTest, DoesNotDependOnTheOrderOfAdding) {
  InvertedIndex forward, backward;
  std::vector<std::shared_ptr<const WordVector>> words;
  for (int i = 0; i < 40; ++i) words.push_back(random_vector(30));
  for (int i = 0; i < 40; ++i) forward.add(KeyframeId(i), words[static_cast<std::size_t>(i)]);
  for (int i = 39; i >= 0; --i) backward.add(KeyframeId(i), words[static_cast<std::size_t>(i)]);
  const auto query = random_vector(40);
  EXPECT_EQ(forward.query(*query), backward.query(*query));
}

TEST_F(InvertedIndexTest, DoesNotReturnRemovedKeyframes) {
  InvertedIndex index;
  index.add(KeyframeId(3), vector_of({WordId(1), WordId(2)}));
  index.add(KeyframeId(5), vector_of({WordId(2), WordId(7)}));
  index.remove(KeyframeId(4));  // not in the index
  EXPECT_EQ(counts(index.query(*vector_of({WordId(2)}))), (Counts{{KeyframeId(3), 1}, {KeyframeId(5), 1}}));
  index.remove(KeyframeId(3));
  EXPECT_FALSE(index.contains(KeyframeId(3)));
  EXPECT_EQ(index.words_of(KeyframeId(3)), nullptr);
  EXPECT_EQ(counts(index.query(*vector_of({WordId(1), WordId(2), WordId(7)}))), (Counts{{KeyframeId(5), 2}}));
  index.remove(KeyframeId(5));
  EXPECT_EQ(index.size(), 0u);
  EXPECT_TRUE(index.query(*vector_of({WordId(2), WordId(7)})).empty());
  index.add(KeyframeId(5), vector_of({WordId(7)}));  // can be added again
  EXPECT_EQ(index.query(*vector_of({WordId(7)})).size(), 1u);
}

TEST_F(InvertedIndexTest, AcceptsWordsThatNoKeyframeContains) {
  InvertedIndex index;
  EXPECT_TRUE(index.query(*vector_of({WordId(0)})).empty());
  index.add(KeyframeId(0), vector_of({WordId(0)}));
  index.add(KeyframeId(1), std::make_shared<const WordVector>());
  EXPECT_TRUE(index.query(*vector_of({WordId(vocabulary_->size() - 1)})).empty());
  EXPECT_TRUE(index.query(WordVector()).empty());
}

}  // namespace
}  // namespace bslam::place
