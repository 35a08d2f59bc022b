#include "place/word_vector.h"

#include <algorithm>

namespace bslam::place {

WordVector::WordVector(const Vocabulary& vocabulary, std::span<const WordId> words) {
  std::vector<WordId> sorted;
  sorted.reserve(words.size());
  std::copy_if(words.begin(), words.end(), std::back_inserter(sorted), [](WordId w) { return w.valid(); });
  std::sort(sorted.begin(), sorted.end());
  double sum = 0;
  for (std::size_t begin = 0; begin < sorted.size();) {
    const std::size_t end = static_cast<std::size_t>(
        std::upper_bound(sorted.begin() + static_cast<std::ptrdiff_t>(begin), sorted.end(), sorted[begin]) -
        sorted.begin());
    // The term frequency is not divided by the number of features, because the normalisation to sum 1 cancels that
    // factor.
    const float weight = static_cast<float>(end - begin) * vocabulary.weight(sorted[begin]);
    if (weight > 0) words_.push_back({sorted[begin], weight});
    sum += weight > 0 ? weight : 0.0f;
    begin = end;
  }
  words_.shrink_to_fit();  // it lives as long as its keyframe
  for (WeightedWord& w : words_) w.weight = static_cast<float>(w.weight / sum);
}

// Both vectors sum to 1, so |a - b|_1 = 2 - 2 * (sum of the smaller weights of the common words).
double l1_score(const WordVector& a, const WordVector& b) {
  double common = 0;
  auto i = a.words().begin(), j = b.words().begin();
  while (i != a.words().end() && j != b.words().end()) {
    if (i->word < j->word) {
      ++i;
    } else if (j->word < i->word) {
      ++j;
    } else {
      common += std::min((i++)->weight, (j++)->weight);
    }
  }
  return std::min(common, 1.0);
}

}  // namespace bslam::place
