// The bag-of-words vector of a frame.
#pragma once

#include <span>
#include <vector>

#include "base/id.h"
#include "place/vocabulary.h"

namespace bslam::place {

struct WeightedWord {
  WordId word;
  float weight = 0;
};

// Words with their weights, sorted by word without duplicates. The weights are positive and sum to 1, unless the vector
// is empty. Immutable.
class WordVector {
 public:
  WordVector() = default;

  // Computes tf-idf weights (Sivic and Zisserman, ICCV 2003) of the words of a frame's unique features, given in any
  // order. Invalid ids and words of weight 0 are ignored.
  WordVector(const Vocabulary& vocabulary, std::span<const WordId> words);

  std::span<const WeightedWord> words() const { return words_; }
  std::size_t size() const { return words_.size(); }
  bool empty() const { return words_.empty(); }
  std::size_t memory_bytes() const { return sizeof(WordVector) + words_.capacity() * sizeof(WeightedWord); }

 private:
  std::vector<WeightedWord> words_;
};

// Similarity of two frames, 1 - 0.5 |a - b|_1 in [0, 1] (Nister and Stewenius, CVPR 2006): 1 for equal vectors, 0 if
// they have no word in common or one is empty.
double l1_score(const WordVector& a, const WordVector& b);

}  // namespace bslam::place
